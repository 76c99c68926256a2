api-admission_too-many-requests-run = 同时运行的请求过多
api-admission_too-many-requests-without = 未登录的请求过多
api-admission_too-many-requests-without-login = 同时运行的未登录请求过多
