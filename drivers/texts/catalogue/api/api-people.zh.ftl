api-people_no-authority = 本站没有自己的签发机构
    .remedy = 请通过 HTTPS 访问；若本站使用公司的证书，则该证书已受信任
api-people_no-session = 没有该会话
api-people_no-token = 没有该令牌
api-people_script-invites-nobody = 脚本不能邀请他人
    .remedy = 请在页面上操作
