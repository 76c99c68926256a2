library_another-station-already = 本站点已有另一个 { $value }
    .remedy = 请先删除该项
library_cannot-kept = 无法保存 { $entry }：{ $cause }
library_contents-missing-damaged = { $label } 的内容缺失或损坏
    .remedy = 请从备份恢复
library_damaged-no-measurement = { $value } 已损坏，或不是测量：{ $cause }
    .remedy = 请选择 servodeck 写出的文件，或取得未损坏的副本
library_exists-already = { $value } 已存在
    .remedy = 请选择其他名称，或允许覆盖
library_exists-already-choose-another = { $value } 已存在
    .remedy = 请选择其他名称
library_exists-already-choose-another-2 = { $value } 已存在
    .remedy = 请选择其他名称，或允许保存为新版本
library_lies-folder-station = { $label } 位于站点 { $station } 的文件夹中
    .remedy = 请在该站点打开，或在该处放入共享库
library_no-entry-library = 库中没有条目 { $value }
    .remedy = 请从“文件”页面选择
library_no-file-name-kind = { QUOTED($value) } 不是此类文件的名称
    .remedy = 请使用此类文件的扩展名
library_no-file-station = { $value } 不是本站点的文件
    .remedy = 此库的每个站点都已有该文件，或它已被删除
library_no-measurement = 没有测量 { $value }
library_no-measurement-choose-list = 没有测量 { $value }
    .remedy = 请从列表中选择；它可能已被他人删除
library_no-parameter-set = 没有参数集 { $value }
    .remedy = 请从“文件”页面选择
library_no-version = { $item } 没有版本 { $value }
    .remedy = 请选择其版本之一
library_not-shared-contents-recording = { $value } 不是录制、测量或报告的共享内容
    .remedy = 请先在其站点共享
library_notes-changed = 备注在此期间已被修改：现为 { QUOTED($value) }
    .remedy = 请比较两个文本，并写入应保留的内容
library_notes-too-long = 备注过长
    .remedy = 请缩短备注
library_too-large-library = { $entry } 对库而言过大
    .remedy = 请下载后手动复制，或录制较少的信号
library_too-many-tags-too = 标签过多，或其中之一过长
    .remedy = 请使用较少或较短的标签
library_written-newer-version = { $value } 由更新的版本写出
    .remedy = 请更新 servodeck 后再打开
library_saved-from = 保存时驱动器的{ $what ->
        [vendor] 厂商编号
        [product] 产品代码
        [serial] 序列号
        [revision] 修订号
       *[firmware] 固件
    }为 { $theirs }，此驱动器为 { $ours }
library_set-cannot-be-read = 无法读取 { $name }：{ $cause }
library_tags-changed = 标签在此期间已被修改：现为 { QUOTED($value) }
    .remedy = 请比较两者，并写入应保留的标签
