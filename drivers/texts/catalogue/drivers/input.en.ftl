input_boolean = Input should be true or false
input_extra = Extra inputs are not permitted
input_few = There should be at least { $bound } { $bound ->
    [one] item
   *[other] items
    }, not { $count }
input_finite = Input should be a finite number
input_greater-than = Input should be greater than { $bound }
input_greater-than-equal = Input should be greater than or equal to { $bound }
input_integer = Input should be a valid integer
input_integer-fraction = Input should be a valid integer, got a number with a fractional part
input_integer-size = The integer is too large to be read
input_json = Not valid JSON: { $cause }
input_kind-missing = Field { $field } is required: it names the kind
input_kind-unknown = { $field } is { $value }; it should be one of { $allowed }
input_less-than = Input should be less than { $bound }
input_less-than-equal = Input should be less than or equal to { $bound }
input_list = Input should be a valid list
input_many = There should be at most { $bound } { $bound ->
    [one] item
   *[other] items
    }, not { $count }
input_missing = Field required
input_multiple-of = Input should be a multiple of { $step }
input_none = Input should be null
input_number = Input should be a valid number
input_object = Input should be a valid object
input_one-of = Input should be one of { $allowed }
input_refused = { $place }: { $reason }
input_safe-only-at-enable = safe_in_motion is for at_enable only
input_scale-not-upwards = the scale must go upwards: { $low } is not below { $high }
input_string = Input should be a valid string
input_string-long = String should have at most { $bound } { $bound ->
    [one] character
   *[other] characters
    }
input_string-pattern = String should match pattern { $pattern }
input_string-short = String should have at least { $bound } { $bound ->
    [one] character
   *[other] characters
    }
input_string-unicode = Input should be a valid string: it is no Unicode text
input_time = Input should be a valid date and time
input_time-zone = The time should have a time zone
input_truth = true and false are no values of a parameter: give the number
input_unprintable = sign { $number } ({ $character }) cannot be printed: leave out control characters
