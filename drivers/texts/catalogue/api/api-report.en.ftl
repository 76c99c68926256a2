api-report_not-measured = { $value } was not measured on { $drive }
    .remedy = choose measurements of this drive
