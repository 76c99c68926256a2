api-admission_too-many-requests-run = too many requests run at once
api-admission_too-many-requests-without = too many requests without login
api-admission_too-many-requests-without-login = too many requests without login run at once
