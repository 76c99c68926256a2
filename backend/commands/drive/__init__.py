"""Commands about one drive: parameters, functions, scales, hand-over, profile, jog and scope."""
