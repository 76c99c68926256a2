"""EtherCAT slave information files (ETG.2000): devices, modules, objects, PDOs, bring-up."""
