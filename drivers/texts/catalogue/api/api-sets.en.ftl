api-sets_give-either-file-against = give either file or against
    .remedy = choose one thing to compare with
api-sets_larger-bytes = { $file } is larger than { $max_bytes } bytes
    .remedy = choose another file
api-sets_base-other-family = the base is of another drive family
api-sets_other-family = the file is of another drive family: nothing of it can be written to this drive
