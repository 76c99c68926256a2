store_audit-broken-entry = 审计在记录 { $value } 处中断：{ $why }
    .remedy = 请保留较早的备份；查明谁更改了数据库
store_audit-broken-entry-nothing = { $shown }：审计在记录 { $value } 处中断：{ $why }；未作任何更改
    .remedy = 请使用未损坏的备份
store_backup-not-written = 无法写入备份 { $archive }：{ $strerror }
    .remedy = 请释放空间或选择其他文件夹；没有留下不完整的归档
store_cannot-restored-nothing-changed = 无法恢复 { $value }：{ $why }；未作任何更改
    .remedy = 请使用未损坏的备份
store_cannot-used-contents = 无法将 { $split }:// 用于内容：{ $cause }
    .remedy = 请安装缺少的组件或选择文件夹
store_contents-damaged = { $place } 的内容 { $name }… 已损坏
    .remedy = 请从备份恢复
store_contents-missing = { $place } 缺少内容 { $name }…
    .remedy = 请从备份恢复
store_contents-not = 无法在 { $value } { $what ->
        [stored] 存储
        [fetched] 读取
        [listed] 列出
        [found] 找到
        [deleted] 删除
       *[other] 处理
    }内容：{ $error }
    .remedy = 请检查可用空间、权限；若为 S3，还请检查地址和密钥
store_database-address-not-url = 数据库地址不是 URL
    .remedy = 请写成 postgresql://user:password@host/name 或 sqlite:////folder/file.db
store_database-busy = 数据库 { $value } 已忙 { $sqlite_patience_s } s
    .remedy = 请重试；若持续，则磁盘过慢或有故障
store_database-cannot-made = 无法建立数据库 { $file }：{ $strerror }
    .remedy = 请用 --config 选择其他文件夹
store_database-damaged = 数据库 { $source } 已损坏：{ $found }
    .remedy = 请保留较早的备份并恢复其中之一
store_database-damaged-no-database = 数据库 { $value } 已损坏，或不是数据库：{ $first }
    .remedy = 请保留文件副本并恢复备份（`servodeck restore`）；servodeck 未尝试修复，也不知道哪些部分完好
store_database-failed = 数据库 { $value } 出错：{ $first }
    .remedy = 请检查可用空间、权限；若为 PostgreSQL，还请检查其服务器是否运行且可访问
store_exists-already = { $archive } 已存在
    .remedy = 请选择其他名称，或用 --overwrite 替换
store_library-audit-already-nothing = { $value } 已有库或审计；未作任何更改
    .remedy = 请选择空数据库
store_needs-bytes-disk-not = { $archive } 需要 { $value } 字节，磁盘空间不足
    .remedy = 请释放存储空间或选择其他文件夹
store_no-name-contents = { QUOTED($value) } 不是内容名称
store_no-whole-backup-nothing = { $archive } 不是完整的备份：{ $cause }；未作任何更改
    .remedy = 请使用未损坏的备份
store_not-empty-nothing-changed = { $folder } 不为空；未作任何更改
    .remedy = 请选择其他文件夹，或允许替换（原内容另行保留）
store_not-file-name = { QUOTED($value) } 不是文件名
    .remedy = 请选择不含文件夹的普通名称
store_not-restored = 无法将 { $archive } 恢复到 { $folder }：{ $strerror }
    .remedy = 请释放存储空间或选择其他文件夹
store_not-tell-when-contents = { $place } 未提供内容的存储时间
store_not-written = 无法写入 { $path }：{ $strerror }
    .remedy = 请释放存储空间或选择其他文件夹；旧文件完好
store_put-database-back = 请将其恢复原状，或结束 servodeck 并恢复备份
store_running-servodeck-uses-nothing = 运行中的 servodeck 正在使用 { $folder }；未作任何更改
    .remedy = 请先结束它
store_servodeck-cannot-use-database = servodeck 不能使用 { $value } 数据库
    .remedy = 请选择其中之一
store_sqlite-database-memory-forget = 内存中的 SQLite 数据库在程序结束时丢失
    .remedy = 请指定文件：sqlite:////folder/file.db
store_state-newer = { $folder } 中的状态由 servodeck { $program } 写出（状态版本 { $value }）；本程序为 { $have }，只支持到状态版本 { $limit }，无法读取
    .remedy = 请安装 servodeck { $program } 或更新的版本；或恢复由 { $have } 所作的备份：`servodeck restore BACKUP --replace --config { $folder }`。未写入任何内容
store_state-version-unreadable = 无法从 { $file } 读取状态文件夹的版本：{ $cause }
    .remedy = 请恢复备份（`servodeck restore BACKUP --replace`）；如果没有更新的 servodeck 用过此文件夹，可删除该文件。未写入任何内容
store_written-newer-servodeck = { $value } 由更新的 servodeck 写出（版本 { $have }）
    .remedy = 请更新本站点的 servodeck；未作任何更改
store_folder-gone = 状态文件夹 { $folder } 已不存在
store_database-replaced = 数据库 { $database } 在 servodeck 运行期间被移除或替换
store_backup-contents = 其内容与清单所列不符
store_backup-damaged = { $part } 已损坏（{ $cause }）
store_backup-manifest = 其中没有可用的清单（{ $cause }）
store_backup-name = { QUOTED($part) } 不是备份中应有的名称
store_backup-newer = 它由较新版本的 servodeck 生成
store_backup-other = 它是其他文件
store_backup-part-differs = { $part } 与备份时不一致
