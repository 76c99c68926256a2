"""MLink (RS485): Modbus RTU frames with the object-to-register rule of EZmotion."""
