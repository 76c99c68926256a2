api-people_no-authority = this station has no authority of its own
    .remedy = come by HTTPS; where the station has a certificate of the company's, that is trusted already
api-people_no-session = there is no such session
api-people_no-token = there is no such token
api-people_script-invites-nobody = a script invites nobody
    .remedy = do it on the page
