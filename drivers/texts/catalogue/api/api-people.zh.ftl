api-people_no-session = 没有该会话
api-people_no-token = 没有该令牌
api-people_script-invites-nobody = 脚本不能邀请他人
    .remedy = 请在页面上操作
