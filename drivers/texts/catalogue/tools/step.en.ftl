step_no-size = size must not be 0
step_step-needs-rev-more = the step needs { NUM($highest, format: ".4g") } { $name } and { NUM($travelled_rev, format: ".3g") } rev, more than the envelope of { NUM($speed_rpm, format: "g") } rpm and { NUM($travel_rev, format: "g") } rev
    .remedy = choose a smaller step or a wider envelope
step_stepping = stepping
step_title = Step response
