"""Axis motion shared by the cyclic buses: loop, setpoints, envelope."""
