/** Objects whose meaning CiA 402-2 fixes for every drive that has them. */
export const DIGITAL_INPUTS = '60FD:00'
export const DIGITAL_OUTPUTS = '60FE:01'
export const POSITION_ACTUAL = '6064:00'
export const VELOCITY_ACTUAL = '606C:00'
export const TORQUE_ACTUAL = '6077:00'
export const STATUS_WORD = '6041:00'
export const HOME_OFFSET = '607C:00'
export const SOFTWARE_LIMITS = ['607D:01', '607D:02'] as const
