preflight_adapter-in-use = { $device } is open in a program, and the change restarts the adapter
    .remedy = close the bus on { $device } or the other program, then repeat
preflight_as-administrator = as the administrator of the computer: { $command }
preflight_cannot-restored = { $setting } cannot be restored to { $value }: { $strerror }
    .remedy = restart the computer, which restores it
preflight_cannot-set = { $setting } cannot be set to { $value }: { $strerror }
preflight_ethercat-master-servodeck-uses = an EtherCAT master of servodeck uses { $interface }
    .remedy = close that bus first, or run the preflight without an interface
preflight_latency-as-administrator = start servodeck once as the administrator of Windows, or set it by hand: Device Manager, Ports, { $device }, Port Settings, Advanced, Latency Timer: { $ms }
preflight_latency-as-root = as the administrator of the computer: echo { $ms } | sudo tee /{ $place }
preflight_latency-denied = the latency timer of { $device } cannot be set to { $value }: only the administrator of the computer may
preflight_latency-failed = the latency timer of { $device } cannot be set to { $value }: { $strerror }
    .remedy = plug the adapter in again, then repeat
preflight_latency-list-unreadable = the list of changed latency timers cannot be read: { $path }
    .remedy = delete the file; the timers then stay as they are
preflight_latency-not-changed = servodeck has not changed the latency timer of { $device }
preflight_latency-range = { $value } is not a latency timer
    .remedy = choose { $limit } ms
preflight_list-preflight-changed-cannot = the list of what the preflight changed cannot be read: { $path }
    .remedy = restart the computer, which restores these settings, and delete the file
preflight_measurement-failed = the measurement { $interface ->
    [none] on this computer
   *[other] on { $interface }
 } failed: { $reason }
    .remedy = run the preflight without an interface, and check its first finding
preflight_no-latency-timer = no latency timer is known of the adapter { $device }
    .remedy = only chips of FTDI have one: check the name of the port
