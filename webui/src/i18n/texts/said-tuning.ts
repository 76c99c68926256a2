import type { Texts } from '../types'

/**
 * What the server says of measurements and of tuning: warnings, verdicts, refusals and what to do.
 * As in said.ts, the English is the server's own; tests/unit/test_said.py holds both together.
 */
export const saidOfTuning = {
  // What a frequency response says of itself.
  'said.wPlay': [
    'between the excited lines there is {share} of their motion, which friction does not explain: the axis has play (gear, coupling, key), or it is excited too weakly against its friction. Its response depends on how hard it is driven: no model is made of it, and above a quarter of the sample rate nothing is shown',
    '在激励谱线之间有 {share} 的运动，无法用摩擦解释：轴存在间隙（齿轮、联轴器、键），或相对摩擦而言激励太弱。其响应随驱动强弱而变：不建立模型，采样率四分之一以上不显示',
  ],
  'said.wNoModel': [
    'no mechanical model explains the recording: only the part of the plot below a tenth of the sample rate is shown, and nothing is designed from it',
    '没有机械模型能解释该记录：仅显示采样率十分之一以下的部分，且不据此进行设计',
  ],
  'said.wUnknownAbove': [
    'above {hz} Hz the response is not known well enough: what is folded back there hides it. Nothing is concluded from what lies above; a shorter cycle shows it',
    '{hz} Hz 以上的响应不够确知：被折叠回来的成分将其掩盖。不据以上部分下结论；缩短周期可使其显现',
  ],
  'said.undoStale': [
    '{name}: {key} is {raw} now, where this change had left {left}: it was changed again since, so nothing was undone',
    '{name}：{key} 现为 {raw}，而此更改写入的是 {left}：之后又被修改过，因此未撤销',
  ],
  'said.rUndoStale': [
    'look at the list of changes; undo it all the same, or write the value that you want',
    '请查看更改列表；仍然撤销，或写入所需的值',
  ],
  'said.wSaturated': [
    'the torque was at its limit, or not what was commanded, for {share} of the time: lower the excitation or raise the limit',
    '转矩在 {share} 的时间内达到限值，或与指令不符：请减小激励或提高限值',
  ],
  'said.wCoherence': [
    'coherence is low: raise the excitation, or look for backlash and friction',
    '相干性偏低：请增大激励，或检查间隙和摩擦',
  ],
  'said.wDropped': [
    '{count} periods had lost samples and were left out',
    '{count} 个周期因丢失采样而被舍弃',
  ],
  'said.wRated': [
    'the drive does not tell its rated torque: magnitudes are per rated torque',
    '驱动器未提供额定转矩：幅值以额定转矩为单位',
  ],
  'said.wCommanded': [
    'the drive reports the torque that it commands: what its current loop takes is not known, and is charged to the band',
    '驱动器上报的是指令转矩：其电流环的影响未知，已计入置信带',
  ],
  'said.wMean': [
    'the drive reports its speed as the mean of {cycles} cycles, from which mechanics cannot be told; switch that averaging off, or take another cycle time',
    '驱动器上报的速度是 {cycles} 个周期的平均值，无法由此辨识机械特性；请关闭该平均，或选择其他周期',
  ],
  // Why a frequency response is not measured.
  'said.sPull': [
    'a load of {nm} Nm pulls the axis, so it cannot be measured without a closed loop',
    '有 {nm} Nm 的负载拉动轴，因此不能在开环下测量',
  ],
  'said.sPullTry': [
    'measure with the speed or position loop closed',
    '请在速度环或位置环闭合时测量',
  ],
  'said.sStepped': [
    'a stepped sine lasts too long for an axis that no loop holds',
    '对于没有闭环保持的轴，步进正弦持续时间过长',
  ],
  'said.sSteppedTry': ['measure it with the speed loop closed', '请在速度环闭合时测量'],
  'said.sEnvelope': ['the envelope does not allow this measurement', '限值不允许进行此测量'],
  'said.sTravel': [
    'a travel of {rev} rev is too little for the base motion',
    '{rev} rev 的行程不足以进行基础运动',
  ],
  'said.sFriction': [
    '{nm} Nm are too little to keep the axis moving against friction',
    '{nm} Nm 不足以克服摩擦使轴保持运动',
  ],
  'said.sEvaluate': ['the recording cannot be evaluated', '无法分析该记录'],
  'said.sEvaluateTry': [
    'raise the excitation, or look for lost samples and saturated torque',
    '请增大激励，或检查丢失的采样和转矩饱和',
  ],
  'said.sShare': [
    'the excitation takes 1 to 90 % of the permitted torque',
    '激励应为允许转矩的 1 至 90 %',
  ],
  'said.sCount': ['1 to 8 realisations are possible', '激励次数可为 1 至 8'],
  'said.sLow': [
    'the lowest line must lie above the base motion, at 3 Hz or more',
    '最低谱线必须高于基础运动，即不低于 3 Hz',
  ],
  'said.sBand': ['the band must span at least two octaves', '频带至少应跨两个倍频程'],
  // An axis that does not do as it is told.
  'said.pAgainst': [
    '{axis} moves against its torque: the sign of torque or speed is wrong',
    '{axis} 的运动方向与转矩相反：转矩或速度的符号错误',
  ],
  'said.pAgainstTry': [
    'check motor phases, encoder direction and the polarity settings',
    '请检查电机相序、编码器方向和极性设置',
  ],
  'said.pSwings': [
    '{axis} does not stand still under its speed loop: the torque swings by {torque} % and the speed by {speed} rpm',
    '{axis} 在速度环下不能静止：转矩摆动 {torque} %，速度摆动 {speed} rpm',
  ],
  'said.pSwingsTry': ['lower the gains of the speed loop and try again', '请降低速度环增益后重试'],
  'said.pTurns': [
    '{axis} turns with {speed} rpm and {torque} % of its rated torque while its speed loop is to hold it',
    '{axis} 本应由速度环保持静止，却以 {speed} rpm、{torque} % 额定转矩转动',
  ],
  'said.pTurnsTry': [
    'the drive cannot hold it: look at the supply of its power stage, its torque limits, its gains and the load',
    '驱动器无法保持该轴：请检查功率级供电、转矩限值、增益和负载',
  ],
  'said.pStuck': [
    '{axis} does not move with {share} of its rated torque',
    '{axis} 在 {share} 额定转矩下不动',
  ],
  'said.pStuckTry': [
    "look for a closed brake, a blocked axis or a torque limit; raise the envelope's torque only if the machine allows it",
    '请检查抱闸是否闭合、轴是否卡住或转矩限值；仅在机器允许时提高转矩限值',
  ],
  // What ends a measurement.
  'said.eLeft': ['the drive left Operation enabled', '驱动器退出了“运行使能”'],
  'said.eLook': [
    "see the Alarms page; without an alarm look at the emergency stop, the drive's supply and whoever else may disable it, then measure again",
    '请查看“报警”页面；若无报警，请检查急停、驱动器供电以及可能断使能的其他人员，然后重新测量',
  ],
  'said.eLimit': [
    '{name} {value} is beyond the limit of {limit}',
    '{name} {value} 超出限值 {limit}',
  ],
  'said.eBraked': ['the axis is braked and disabled', '轴已制动并断使能'],
  'said.eBrakedOnly': ['the axis is braked', '轴已制动'],
  'said.eRenewed': ['the setpoints were not renewed in time', '设定值未及时更新'],
  'said.eInvalid': [
    'no valid process data for {count} cycles',
    '连续 {count} 个周期没有有效的过程数据',
  ],
  'said.eWiden': [
    'check load, limits and gains, then widen the envelope only if the machine allows it',
    '请检查负载、限值和增益；仅在机器允许时放宽限值',
  ],
  'said.eCable': ["look at the cable and at the drive's supply", '请检查电缆和驱动器供电'],
  'said.eEnded': ['the motion was ended', '运动已结束'],
  'said.eRestored': ['not restored', '未恢复'],
  'said.eServer': ['the server is gone', '服务器已退出'],
  // Inertia and friction: why there is no answer.
  'said.iLimit': [
    'the torque was at its limit: raise the limit or lower the acceleration',
    '转矩达到限值：请提高限值或降低加速度',
  ],
  'said.iOneWay': [
    'motion in one direction only: friction and gravity cannot be told apart',
    '仅有单方向运动：无法区分摩擦和重力',
  ],
  'said.iWeak': [
    'too little acceleration for the noise: raise acceleration, torque or travel',
    '相对噪声而言加速度太小：请增大加速度、转矩或行程',
  ],
  'said.iSign': [
    'the torque opposes the acceleration: wrong sign of torque or velocity',
    '转矩与加速度方向相反：转矩或速度的符号错误',
  ],
  'said.iFriction': [
    'friction comes out negative: something beside inertia and friction drives the axis',
    '计算出的摩擦为负：除惯量和摩擦外还有其他因素驱动轴',
  ],
  'said.iModel': [
    'the moves do not follow inertia and friction (R² below 0.8)',
    '运动不符合惯量与摩擦模型（R² 低于 0.8）',
  ],
  'said.iBacklash': [
    "knocks after each change of the torque's sign: backlash in the drive train",
    '每次转矩换向后出现冲击：传动链存在间隙',
  ],
  'said.iMotor': [
    "the result is below the motor's own inertia: check the motor data",
    '结果小于电机自身惯量：请检查电机数据',
  ],
  'said.iFew': [
    'too few samples in motion: raise travel or speed',
    '运动中的采样太少：请增大行程或速度',
  ],
  'said.iMoves': ['the envelope does not allow the moves', '限值不允许进行这些运动'],
  'said.iMovesTry': [
    'allow more time, speed or torque, or less travel',
    '请允许更长时间、更高速度或转矩，或减小行程',
  ],
  'said.iLong': ['the moves would take {s} s', '运动将需要 {s} s'],
  'said.iShort': ['the moves are too short to be evaluated', '运动太短，无法分析'],
  'said.iShortTry': ['allow more travel or time', '请允许更大的行程或更长时间'],
  'said.iFar': [
    '{axis} moves only {rev} of {aim} rev, with up to {torque} of its rated torque',
    '{axis} 仅移动了 {aim} rev 中的 {rev}，转矩最高达额定值的 {torque}',
  ],
  'said.iTaught': ['the taught scheme needs both ends', '示教方式需要两个端点'],
  'said.iTaughtTry': ['jog to each end and take it', '请点动到每个端点并记录'],
  'said.iOutside': [
    '{axis} stands at {rev} rev, outside the taught ends',
    '{axis} 位于 {rev} rev，在示教端点之外',
  ],
  'said.iOutsideTry': [
    'jog it between the ends, or teach them again',
    '请点动到两端点之间，或重新示教',
  ],
  'said.iGently': [
    'once more, gently: the load swings at {hz} Hz',
    '放缓重做一次：负载以 {hz} Hz 摆动',
  ],
  'said.iMoving': ['reciprocating move', '往复运动中'],
  'said.iNoEnd': ['{axis} found no end within {rev} rev', '{axis} 在 {rev} rev 内未找到端点'],
  'said.iNoEndTry': [
    'use the free scheme if it turns without ends, or allow a longer search',
    '若轴可无限旋转，请用自由方式，或允许更长的寻找距离',
  ],
  'said.iSearch': [
    '{torque} % of torque cannot move this axis safely against its friction and load',
    '{torque} % 转矩不足以克服该轴的摩擦和负载而安全移动',
  ],
  'said.iSearchTry': [
    'raise the torque of the search, or teach the ends by jog',
    '请提高寻找转矩，或用点动示教端点',
  ],
  'said.iGiven': ['the motor inertia given', '输入的电机惯量'],
  'said.iTold': ['the motor inertia that the drive tells', '驱动器提供的电机惯量'],
  'said.iStored': [
    "the inertia stored in the drive, which is the motor's until it is changed",
    '驱动器中存储的惯量，未更改前即电机惯量',
  ],
  // Automatic tuning.
  'said.tNotes': ['designed without notches', '未使用陷波器进行设计'],
  'said.tNear': [
    "a resonance near {hz} Hz bounds the gain, and what this drive's notches do can be measured only where one shows, which with this cycle time is up to {highest} Hz",
    '{hz} Hz 附近的谐振限制了增益；此驱动器陷波器的作用只能在可见的谐振处测量，当前周期下最高到 {highest} Hz',
  ],
  'said.tShorter': ['a shorter cycle allows more', '更短的周期可测得更高'],
  'said.tByStep': [
    'too few lines of the tuned loop stand out of the noise for its margins to be read: it was verified by its standstill, its step, and steps with a raised gain',
    '整定后回路高于噪声的谱线太少，无法读出裕度：已通过静止、阶跃和提高增益后的阶跃进行验证',
  ],
  'said.tCaution': [
    'tuned with caution, without notches and slower',
    '谨慎整定：未用陷波器，响应较慢',
  ],
  'said.tNoModel': [
    'no mechanical model explains the frequency response',
    '没有机械模型能解释该频率响应',
  ],
  'said.tStiff': ['no design meets the goals for a stiff load', '没有方案满足刚性负载的目标'],
  'said.tMedium': ['no design meets the goals for a medium load', '没有方案满足中等刚度负载的目标'],
  'said.tCompliant': [
    'no design meets the goals for a compliant load',
    '没有方案满足柔性负载的目标',
  ],
  'said.tOnModel': ['no design on the model keeps its promise', '基于模型的方案均未达到预期'],
  'said.tBandwidth': [
    'the bandwidth was verified at {measured} Hz instead of the {predicted} Hz that were predicted, with the margins kept: the axis answers otherwise than as it was measured, as with play (gear, coupling, key) or a resonance too narrow for the lines',
    '验证的带宽为 {measured} Hz，而预测为 {predicted} Hz，裕度仍满足：轴的响应与测量时不同，可能因间隙（齿轮、联轴器、键）或谐振窄于谱线间隔',
  ],
  'said.tOtherwise': [
    'the tuned loop answered otherwise than the axis as it was measured before lets expect, as with play (gear, coupling, key) or a resonance too narrow for the lines',
    '整定后回路的响应与此前测得的轴特性所预期的不同，可能因间隙（齿轮、联轴器、键）或谐振窄于谱线间隔',
  ],
  'said.tWasWidth': [
    '-3 dB point at {have} Hz where {want} Hz was predicted',
    '−3 dB 点在 {have} Hz，预测为 {want} Hz',
  ],
  'said.tWasPhase': [
    'phase margin of {have}° where {want}° was predicted',
    '相位裕度 {have}°，预测为 {want}°',
  ],
  'said.tWasGain': [
    'gain margin of {have} dB where {want} dB was predicted',
    '增益裕度 {have} dB，预测为 {want} dB',
  ],
  'said.tAgainSame': [
    'the design keeps all goals for the axis as its loop shows it, too',
    '对于回路中测得的轴特性，该方案同样满足所有目标',
  ],
  'said.tAgainOther': [
    'designed again for the axis both as it was measured and as its loop shows it, with {share} of the speed gain',
    '已针对测得的和回路中显示的轴特性重新设计，速度增益为原方案的 {share}',
  ],
  'said.tAgainVerified': [
    'verified with other realisations at {have} Hz, predicted from the loop at {want} Hz',
    '以其他激励验证为 {have} Hz，根据回路预测为 {want} Hz',
  ],
  'said.tAgainFailed': [
    'a design for the axis as its loop shows it did not keep its promise, so the first one, which did, is in force again',
    '针对回路中轴特性的方案未达到预期，因此恢复使用达到预期的第一个方案',
  ],
  'said.tAgainNone': [
    'no design keeps all goals for the axis both as it was measured and as its loop shows it and is faster than what it had, so this one stays, which kept its promise',
    '没有方案能同时满足测得的和回路中显示的轴特性的所有目标且快于原有设置，因此保留已达到预期的本方案',
  ],
  'said.tAgainTime': [
    'there was no time to design for the axis as its loop shows it',
    '没有时间针对回路中的轴特性进行设计',
  ],
  'said.tAgainUnclear': [
    'too few lines of the loop are known to design for the axis as it shows it',
    '回路中可用的谱线太少，无法据此进行设计',
  ],
  'said.tUnseen': [
    'the loop crosses 0 dB for the last time at {hz} Hz, above the {highest} Hz that were verified with this cycle time: its margins there are predicted, and seen by the standstill and the step alone; a shorter cycle shows them',
    '回路最后一次穿越 0 dB 在 {hz} Hz，高于当前周期下已验证的 {highest} Hz：该处裕度为预测值，仅由静止和阶跃检验；更短的周期可测得',
  ],
  'said.tBounded': [
    'the loop may cross 0 dB up to {hz} Hz, above the {highest} Hz that this cycle time shows: its margins there are predicted, and bounded by the loop being stable with {gain} dB more gain; a shorter cycle measures them',
    '回路最高可能在 {hz} Hz 穿越 0 dB，高于当前周期可测的 {highest} Hz：该处裕度为预测值，并由增益提高 {gain} dB 时仍稳定所限定；更短的周期可测得',
  ],
  'said.tNotShown': [
    'the loop crosses 0 dB at {hz} Hz, above the {highest} Hz that were measured, and was stable with {gain} dB more gain only, instead of {wanted} dB',
    '回路在 {hz} Hz 穿越 0 dB，高于所测的 {highest} Hz，且仅在增益提高 {gain} dB 时稳定，应为 {wanted} dB',
  ],
  'said.tUnstable': [
    'not stable for everything that the axis may be',
    '对轴可能的所有情况并不都稳定',
  ],
  'said.tDropped': [
    'the drive reports another torque (6077h) than the one that moves the axis, such as a filtered one or a copy of the demand: it was not used, and the path to the axis was found from the motion alone',
    '驱动器报告的转矩（6077h）不是驱动轴的转矩，例如经过滤波或为指令的副本：未使用该转矩，仅由运动求得到轴的通路',
  ],
  'said.tSlowOrFiltered': [
    'beside a closed loop a torque that follows slowly and a 6077h that is filtered look alike: no model is made, and nothing is designed from one; measure without a loop, or look for filters of the torque and of its reading in the drive',
    '在闭环下，转矩响应慢与 6077h 经过滤波无法区分：不建立模型，也不据此设计；请在无回路时测量，或检查驱动器中转矩及其读数的滤波器',
  ],
  'said.tSlow': [
    'the torque follows its command more slowly than a current loop: a low-pass of the torque is set in the drive (torque filter), which limits every loop. What the response owes to its form is charged to the band',
    '转矩跟随指令比电流环慢：驱动器中设置了转矩低通（转矩滤波器），它限制所有回路。其形式的影响已计入误差带',
  ],
  'said.tHum': [
    'the torque hums with {rms} % of the rated while it stands',
    '静止时转矩有 {rms} % 额定值的波动',
  ],
  'said.tMsWorstMeasured': [
    'sensitivity {ms} at worst (measured) instead of {promised}',
    '灵敏度最差 {ms}（实测），应为 {promised}',
  ],
  'said.tPmWorstMeasured': [
    'phase margin {pm}° at worst (measured) instead of {promised}°',
    '相位裕度最差 {pm}°（实测），应为 {promised}°',
  ],
  'said.tGmWorstMeasured': [
    'gain margin {gm} dB at worst (measured) instead of {promised} dB',
    '增益裕度最差 {gm} dB（实测），应为 {promised} dB',
  ],
  'said.tMsWorstPredicted': [
    'sensitivity {ms} at worst (predicted) instead of {promised}',
    '灵敏度最差 {ms}（预测），应为 {promised}',
  ],
  'said.tPmWorstPredicted': [
    'phase margin {pm}° at worst (predicted) instead of {promised}°',
    '相位裕度最差 {pm}°（预测），应为 {promised}°',
  ],
  'said.tGmWorstPredicted': [
    'gain margin {gm} dB at worst (predicted) instead of {promised} dB',
    '增益裕度最差 {gm} dB（预测），应为 {promised} dB',
  ],
  'said.tContradicted': [
    'stable with {gain} dB more gain, with which no loop is that the measurements allow: nothing is known above the measured band',
    '增益提高 {gain} dB 时仍稳定，而测量所允许的回路均不稳定：所测频带以上一无所知',
  ],
  'said.tByPlace': [
    'the inertia or the torque depends on the place (once per revolution of the motor, about ±{kgm2} kg·m²), as with a crank, a cam or a load off its axis: the band holds every place',
    '惯量或转矩随位置变化（电机每转一次，约 ±{kgm2} kg·m²），如曲柄、凸轮或偏心负载：误差带涵盖所有位置',
  ],
  'said.tByPlaceUnknown': [
    'the inertia or the torque depends on the place (once per revolution of the motor), as with a crank, a cam or a load off its axis: the band holds every place',
    '惯量或转矩随位置变化（电机每转一次），如曲柄、凸轮或偏心负载：误差带涵盖所有位置',
  ],
  'said.tMs': ['sensitivity {ms} instead of {promised}', '灵敏度 {ms}，应为 {promised}'],
  'said.tPm': ['phase margin {pm}° instead of {promised}°', '相位裕度 {pm}°，应为 {promised}°'],
  'said.tGm': [
    'gain margin {gm} dB instead of {promised} dB',
    '增益裕度 {gm} dB，应为 {promised} dB',
  ],
  'said.tFewLines': [
    'too few lines of the tuned loop could be measured, and its step overshoots',
    '整定后回路可测的谱线太少，且阶跃有超调',
  ],
  'said.tKept': ['kept as it was', '保持原样'],
  'said.tKeptWhy': [
    'its speed gain is higher than that of every design that is left, and the verification kept the promise',
    '原有速度增益高于剩余的所有方案，且验证达到预期',
  ],
  'said.tAsItWas': ['as it was', '原有设置'],
  'said.tSlower': [
    'slower than it was, with {share} of the speed gain that it had',
    '比原来慢，速度增益为原来的 {share}',
  ],
  'said.tMeaning': [
    'the meaning of its notches or filters is not known',
    '其陷波器或滤波器的含义未知',
  ],
  'said.tMargin': [
    'it keeps too little margin for what the axis may be',
    '对轴可能的变化，其裕度太小',
  ],
  'said.tPromise': ['it did not keep the promise when it was verified', '验证时未达到预期'],
  'said.tTime': ['the time for one tuning was used up', '单次整定的时间已用完'],
  'said.tLostAsIs': [
    'what lost samples was not all measured again, as the time for one tuning was used up',
    '丢失采样的部分未全部重新测量，因为单次整定的时间已用完',
  ],
  'said.tOneMove': [
    'the load swings, and the axis was not moved a second time, gently, as the time for one tuning was used up',
    '负载有摆动，但轴未再次平缓移动，因为单次整定的时间已用完',
  ],
  'said.tNoNotchTime': [
    'what they do was not measured, as the time for one tuning was used up',
    '未测量其作用，因为单次整定的时间已用完',
  ],
  'said.tNoNotchTry': [
    'tune again, where it was lost samples that took it with a better link',
    '请重新整定；若原因是丢失采样，请先改善链路',
  ],
  'said.tFewerValues': [
    "what the drive's notches do was measured with fewer of their values, as the time for one tuning was used up",
    '驱动器陷波器的作用仅用较少的数值测量，因为单次整定的时间已用完',
  ],
  'said.tNextTime': ['the next tuning measures it again', '下次整定将重新测量'],
  'said.tLink': ['look at the link quality', '请检查链路质量'],
  'said.tNotchAgain': [
    'there was no time to try its notches again where samples were lost',
    '丢失采样后已没有时间再次尝试其陷波器',
  ],
  'said.tNone': ['no design met its prediction in the verification', '验证时没有方案达到预期'],
  'said.tNoneTry': [
    'all parameters are as before; look for backlash and loose parts, measure again, or choose gains by hand',
    '所有参数均保持原样；请检查间隙和松动部件、重新测量，或手动选择增益',
  ],
  'said.tMechanics': [
    'look at the mechanics first: coupling, belt, play',
    '请先检查机械部分：联轴器、皮带、间隙',
  ],
  'said.tInertia': ['the inertia cannot be identified', '无法辨识惯量'],
  'said.tInertiaTry': [
    'widen the envelope as the text says, and try again',
    '请按提示放宽限值后重试',
  ],
  'said.tSaturated': [
    'the torque was at its limit, or not what was commanded, for {share} of the measurement, so nothing is designed from it',
    '测量中有 {share} 的时间转矩达到限值或与指令不符，因此不据此设计',
  ],
  'said.tSaturatedTry': [
    "raise the drive's torque limits, or lower the envelope's torque",
    '请提高驱动器的转矩限值，或降低此处的转矩限值',
  ],
  'said.tWait': ['{count} parameters wait to take effect', '{count} 个参数尚待生效'],
  'said.tWaitTry': [
    'write the settings, or restart the drive, and try again',
    '请写入设置或重启驱动器后重试',
  ],
  'said.tRated': [
    'its rated torque is not known, so no gain can be computed',
    '额定转矩未知，无法计算增益',
  ],
  'said.tRatedTry': ['give the rated torque of the motor', '请输入电机的额定转矩'],
  'said.tRatio': [
    "its load inertia is a ratio to the motor's, which is not known",
    '其负载惯量以电机惯量的倍数表示，而电机惯量未知',
  ],
  'said.tRatioTry': [
    "enter the motor's inertia, as its nameplate or data sheet tells it",
    '请按铭牌或数据手册输入电机惯量',
  ],
  'said.tFault': ['remove the cause and reset the fault', '请排除原因并复位故障'],
  'said.tNearEnd': [
    '{axis} stands too near to an end to measure what its notches do',
    '{axis} 距端点太近，无法测量陷波器的作用',
  ],
  'said.tNearEndTry': ['jog it away from the end, then tune again', '请点动离开端点后重新整定'],
  // Notches and gains that a profile describes.
  'said.nOff': [
    'the manual does not say how this notch is switched off',
    '手册未说明如何关闭此陷波器',
  ],
  'said.nOffTry': [
    "leave it as it is, or give it a frequency far above the loop's bandwidth",
    '请保持原样，或将其频率设为远高于回路带宽',
  ],
  'said.nMeasured': ['as measured on this drive', '按本驱动器的实测结果'],
  'said.nNone': ['{profile} documents no notch filters', '{profile} 的手册未说明陷波器'],
  'said.nNoneTry': [
    'lower the loop gain, or stiffen the mechanics',
    '请降低回路增益，或提高机械刚度',
  ],
  'said.nDepth': ['depth not printed in the manual', '手册未给出深度'],
  'said.nLevels': ['levels without a printed meaning', '等级的含义手册未说明'],
  'said.nMeasure': [
    'no manual prints what its levels mean: let them be measured first, or set levels on the Parameters page and measure',
    '手册均未说明其等级的含义：请先测量，或在“参数”页面设置等级后测量',
  ],
  'said.nEnvelope': ['the envelope does not allow to measure the notches', '限值不允许测量陷波器'],
  'said.nNothing': [
    'its notch at {hz} Hz does nothing that the torque shows',
    '其 {hz} Hz 处的陷波器对转矩没有可见作用',
  ],
  'said.nNothingTry': [
    'look whether another function of the drive owns the notches',
    '请检查陷波器是否被驱动器的其他功能占用',
  ],
  'said.nTrying': ['trying notch {n} of {count}', '测试第 {n} 个陷波器，共 {count} 个'],
  'said.nWithout': ['trying without a notch', '不带陷波器测试'],
  'said.nStiff': [
    'its speed loop is so stiff that a notch might make it swing while what it does is measured',
    '其速度环增益过高，测量陷波器作用时可能引起振荡',
  ],
  'said.nStiffTry': ['lower the speed gain, and tune again', '请降低速度增益后重新整定'],
  'said.nLevelsYet': [
    'the levels have not been measured on this drive yet',
    '尚未在本驱动器上测量这些等级',
  ],
  'said.nMeaning': [
    'the manual does not print what the gains of {profile} mean, so none can be computed',
    '手册未说明 {profile} 增益的含义，因此无法计算',
  ],
  // Measured by speed, without a watchdog.
  'said.uNoWatchdog': [
    'the drive has no watchdog that ends a speed when this computer falls silent: if the cable is pulled or the program dies during the measurement, the axis goes on with its last speed until its own travel limit or its emergency stop',
    '该驱动器没有在本计算机失联时终止速度的看门狗：若测量期间电缆被拔出或程序中止，轴将以最后的速度继续运行，直到其自身的行程限位或急停',
  ],
  'said.uNoLimit': [
    'none of its own travel limits is active, so nothing would stop the axis if this computer fell silent',
    '其自身的行程限位均未启用，若本计算机失联，将没有任何措施使轴停下',
  ],
  'said.uNoLimitTry': [
    'assign a positive and a negative limit to its inputs, or home it and switch its software limits on',
    '请为其输入分配正、负限位，或回零后启用软件限位',
  ],
  'said.uConsent': [
    "activate the drive's travel limits, keep a hand on the emergency stop, and agree to this measurement",
    '请启用驱动器的行程限位，手放在急停上，并同意此次测量',
  ],
  'said.uEnabled': ['{axis} is enabled', '{axis} 处于使能状态'],
  'said.uEnabledTry': ['disable it before the measurement', '测量前请断使能'],
  // Steps.
  'said.kBigTry': ['take a smaller step or a wider envelope', '请减小阶跃或放宽限值'],
} as const satisfies Texts
