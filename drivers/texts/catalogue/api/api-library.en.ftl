api-library_lies-station = { $value } lies on station { $station }
    .remedy = delete it there
api-library_no-finished-file-station = { $value } is no finished file of this station
    .remedy = share it on its station, when it has ended
api-library_no-longer-folder = { $value } is no longer in its folder
    .remedy = it was deleted; search again
api-library_no-thing-library = there is no such thing in the library
