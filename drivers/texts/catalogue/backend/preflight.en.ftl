preflight_as-administrator = as the administrator of the computer: { $command }
preflight_cannot-restored = { $setting } cannot be restored to { $value }: { $strerror }
    .remedy = restart the computer, which restores it
preflight_cannot-set = { $setting } cannot be set to { $value }: { $strerror }
preflight_ethercat-master-servodeck-uses = an EtherCAT master of servodeck uses { $interface }
    .remedy = close that bus first, or run the preflight without an interface
preflight_list-preflight-changed-cannot = the list of what the preflight changed cannot be read: { $path }
    .remedy = restart the computer, which restores these settings, and delete the file
preflight_measurement-failed = the measurement { $interface ->
    [none] on this computer
   *[other] on { $interface }
 } failed: { $reason }
    .remedy = run the preflight without an interface, and check its first finding
