api-sets_give-either-file-against = give either file or against
    .remedy = choose one thing to compare with
api-sets_larger-bytes = { $file } is larger than { $max_bytes } bytes
    .remedy = choose another file
