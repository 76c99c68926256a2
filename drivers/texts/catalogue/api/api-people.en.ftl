api-people_no-authority = this station has no certificate authority of its own
    .remedy = open the page by HTTPS; a certificate issued by the company is trusted already
api-people_no-session = there is no such session
api-people_no-token = there is no such token
api-people_script-invites-nobody = a script cannot create an invitation
    .remedy = create it on the page
