api-library_lies-station = { $value } is stored on station { $station }
    .remedy = delete it there
api-library_no-finished-file-station = { $value } is not a finished file of this station
    .remedy = share it on its station after it has ended
api-library_no-longer-folder = { $value } is no longer in its folder
    .remedy = it was deleted; search again
api-library_no-thing-library = there is no such entry in the library
