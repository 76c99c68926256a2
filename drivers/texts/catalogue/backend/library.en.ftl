library_another-station-already = another { $value } is on this station already
    .remedy = delete that one first
library_cannot-kept = { $entry } cannot be stored: { $cause }
library_contents-missing-damaged = the contents of { $label } are missing or damaged
    .remedy = restore them from a backup
library_damaged-no-measurement = { $value } is damaged, or no measurement: { $cause }
    .remedy = choose a file that servodeck wrote, or get an undamaged copy
library_exists-already = { $value } exists already
    .remedy = choose another name, or allow overwriting
library_exists-already-choose-another = { $value } exists already
    .remedy = choose another name
library_exists-already-choose-another-2 = { $value } exists already
    .remedy = choose another name, or allow a new version of it
library_lies-folder-station = { $label } is stored in a folder of station { $station }
    .remedy = open it on that station, or put it into the shared library there
library_no-entry-library = there is no entry { $value } in the library
    .remedy = choose one from the Files page
library_no-file-name-kind = { QUOTED($value) } is not a file name of this kind
    .remedy = give the file the ending of its kind
library_no-file-station = { $value } is not a file of this station
    .remedy = every station of this library has it already, or it was deleted
library_no-measurement = there is no measurement { $value }
library_no-measurement-choose-list = there is no measurement { $value }
    .remedy = choose one of the list; another person may have deleted it
library_no-parameter-set = there is no parameter set { $value }
    .remedy = choose one from the Files page
library_no-version = { $item } has no version { $value }
    .remedy = choose one of its versions
library_not-shared-contents-recording = { $value } is not shared contents of a recording, measurement or report
    .remedy = share it on its station first
library_notes-changed = the notes were changed meanwhile: they are now { QUOTED($value) }
    .remedy = compare both texts, and write what shall stand there
library_notes-too-long = the notes are too long
    .remedy = shorten the notes
library_too-large-library = { $entry } is too large for the library
    .remedy = download it and copy it by hand, or record fewer signals
library_too-many-tags-too = too many tags, or one is too long
    .remedy = use fewer or shorter tags
library_written-newer-version = { $value } was written by a newer version
    .remedy = update servodeck to open it
library_saved-from = it was saved from { $what ->
        [vendor] vendor id
        [product] product code
        [serial] serial number
        [revision] revision
       *[firmware] firmware
    } { $theirs }, this drive has { $ours }
library_set-cannot-be-read = { $name } cannot be read: { $cause }
library_tags-changed = the tags were changed meanwhile: they are now { QUOTED($value) }
    .remedy = compare both, and write those that shall stand there
