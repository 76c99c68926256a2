"""Small description files with the oddities that makers' public files contain.

Each text was written for these tests; no maker's file is copied. The comments say in the files
of which makers, or of which tools that they use, the oddity was seen.
"""

from profiles.importer import ImportedProfile
from profiles.importer.report import Fact


def facts(imported: ImportedProfile) -> list[tuple[str, dict[str, Fact]]]:
    """Code and facts of each finding."""
    return [(each.code, dict(each.params)) for each in imported.report.findings]


GOOD_EDS = """\
[FileInfo]
FileName=good.eds
EDSVersion=4.0

[DeviceInfo]
VendorName=Example Drives
VendorNumber=0x000001A2
ProductName=Servo 400
ProductNumber=0x00000190
RevisionNumber=0x00010002

[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0

[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2

[1018sub0]
ParameterName=Number of entries
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=1

[1018sub1]
ParameterName=Vendor ID
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x1A2

[2010]
ParameterName=Gain (1/s)
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=40
LowLimit=1
HighLimit=2000

[6040]
ParameterName=Controlword
ObjectType=0x7
DataType=0x0006
AccessType=rww
DefaultValue=0
PDOMapping=1

[6041]
ParameterName=Statusword
ObjectType=0x7
DataType=0x0006
AccessType=ro
PDOMapping=1

[607A]
ParameterName=Target position
ObjectType=0x7
DataType=0x0004
AccessType=rww
PDOMapping=1
LowLimit=0x80000000
HighLimit=0x7FFFFFFF

[6081]
ParameterName=Profile velocity
ObjectType=0x7
DataType=0x0007
AccessType=rw

[1600]
ParameterName=RPDO 1 mapping
ObjectType=0x9
SubNumber=2

[1600sub0]
ParameterName=Entries
DataType=0x0005
AccessType=rw
DefaultValue=1

[1600sub1]
ParameterName=First
DataType=0x0007
AccessType=rw
DefaultValue=0x60400010

[1A00]
ParameterName=TPDO 1 mapping
ObjectType=0x9
SubNumber=2

[1A00sub0]
ParameterName=Entries
DataType=0x0005
AccessType=rw
DefaultValue=1

[1A00sub1]
ParameterName=First
DataType=0x0007
AccessType=rw
DefaultValue=0x60410010
"""


def with_object(text: str) -> bytes:
    """A good file with this text at its end."""
    return (GOOD_EDS + "\n" + text).encode()


ODD_EDS: dict[str, str] = {
    # Lenze: blanks after "=", empty values, one-digit types
    "blanks": "[2100]\nParameterName = Rate\nObjectType=0x07\nDataType= 0x0006\nAccessType=rw\n"
    "DefaultValue=\nPDOMapping=0\n",
    # Advanced Motion Controls: subindices whose object has no section
    "orphan": "[2100sub0]\nParameterName=n\nDataType=5\nAccessType=ro\nDefaultValue=1\n"
    "[2100sub1]\nParameterName=Rate\nDataType=0x6\nAccessType=rw\nDefaultValue=3\n",
    # Faulhaber and others: "Sub" in capitals, indices in small letters
    "sub_case": "[210a]\nParameterName=Rec\nObjectType=9\nSubNumber=2\n"
    "[210aSub0]\nDataType=5\nAccessType=ro\n[210ASUB1]\nParameterName=Rate\nDataType=6\n"
    "AccessType=RW\nDefaultValue=3\n",
    # Engel: one-bit BOOLEAN
    "boolean": "[2100]\nParameterName=Rate\nDataType=1\nAccessType=rw\nDefaultValue=TRUE\n",
    # an inverter supplier: whole numbers with a decimal point
    "point": "[2100]\nParameterName=Rate\nDataType=7\nAccessType=rw\nDefaultValue=5.0\n",
    # CANfestival's editor: types defined by the file for values with limits
    "deftype": "[A0]\nParameterName=UNSIGNED16_1\nObjectType=0x5\nSubNumber=4\n"
    "[A0sub0]\nDataType=5\n[A0sub1]\nDataType=5\n[A0sub2]\nDataType=0x6\n"
    "[2100]\nParameterName=Rate\nDataType=0xA0\nAccessType=rw\nDefaultValue=3\n",
    # E35 example files: numbers with leading zeros
    "zeros": "[2100]\nParameterName=Rate\nDataType=0x0006\nAccessType=rw\nDefaultValue=0050\n",
    # Weidmüller: sections of pluggable modules
    "modules": "[M1SubExt1027]\nParameterName=x\n[M1ModuleInfo]\nProductName=x\n"
    "[2100]\nParameterName=Rate\nDataType=6\nAccessType=rw\n",
    # several generators: compact arrays
    "compact": "[2100]\nParameterName=Rate\nObjectType=8\nDataType=6\nAccessType=rw\n"
    "CompactSubObj=3\nDefaultValue=7\n[2100Name]\nNrOfEntries=1\n2=Second\n"
    "[2100Value]\nNrOfEntries=1\n3=9\n",
    # home-made bridges: one-letter access, CANopenNode: limits that depend on the node number
    "access": "[2100]\nParameterName=Rate\nDataType=7\nAccessType=R\nDefaultValue=$NODEID+0x180\n"
    "LowLimit=$NODEID\n",
    # old servo drives: two's complement limits, maximum below minimum
    "limits": "[2100]\nParameterName=Rate\nDataType=3\nAccessType=rw\nDefaultValue=0xFFFE\n"
    "LowLimit=100\nHighLimit=-100\n",
    # stepper drives: 0 and 0 for limits that nobody gave
    "no_limits": "[2100]\nParameterName=Rate\nDataType=6\nAccessType=rw\nDefaultValue=10\n"
    "LowLimit=0\nHighLimit=0\n",
    # hand-edited files: comments behind values, stray lines, unclosed headings
    "stray": "this line is lost\n[2100\nParameterName=Rate ; in Hz\nDataType=0x6 ; word\n"
    "AccessType=rw\nDefaultValue=0x10h\n",
    # Delta-like: hexadecimal with an h, unknown access
    "suffix": "[2100]\nParameterName=Rate\nDataType=6\nAccessType=rwx\nDefaultValue=10h\n",
    # several: a type that CiA 301 does not know
    "unknown_type": "[2100]\nParameterName=Rate\nDataType=0x00FF\nAccessType=rw\n",
    # the same object twice
    "twice": "[2100]\nParameterName=Rate\nDataType=6\nAccessType=rw\nDefaultValue=1\n"
    "[2100]\nParameterName=Other\nDefaultValue=2\n",
    # wrong counts
    "count": "[2100]\nParameterName=Rec\nObjectType=9\nSubNumber=9\n[2100sub0]\nDataType=5\n"
    "AccessType=ro\n[2100sub1]\nParameterName=Rate\nDataType=6\nAccessType=rw\n"
    "[ManufacturerObjects]\nSupportedObjects=5\n1=0x2100\n2=0x2999\n",
    # a standard object with the sign wrong
    "sign": "[606C]\nParameterName=Velocity actual value\nDataType=7\nAccessType=ro\nPDOMapping=1\n"
    "HighLimit=0xFFFFFFFF\n",
    # a standard object without any type
    "no_type": "[6064]\nParameterName=Position actual value\nAccessType=ro\nPDOMapping=1\n",
}

GOOD_ESI = """\
<?xml version="1.0" encoding="UTF-8"?>
<EtherCATInfo Version="1.6">
 <Vendor><Id>#x00000A2B</Id><Name>Example Drives</Name></Vendor>
 <Descriptions><Devices>
  <Device Physics="YY">
   <Type ProductCode="#x00000190" RevisionNo="#x00000002">ES4</Type>
   <Name LcId="1031">Antrieb ES4</Name>
   <Name LcId="1033">Drive ES4</Name>
   <Profile><ProfileNo>402</ProfileNo><Dictionary>
    <DataTypes>
     <DataType><Name>UDINT</Name><BitSize>32</BitSize></DataType>
     <DataType><Name>DT6099</Name><BitSize>80</BitSize>
      <SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type>
       <BitSize>8</BitSize><BitOffs>0</BitOffs></SubItem>
      <SubItem><SubIdx>1</SubIdx><Name>Speed for switch</Name><Type>UDINT</Type>
       <BitSize>32</BitSize><BitOffs>16</BitOffs>
       <Flags><Access>rw</Access><PdoMapping>R</PdoMapping></Flags></SubItem>
      <SubItem><SubIdx>2</SubIdx><Name>Speed for zero</Name><Type>UDINT</Type>
       <BitSize>32</BitSize><BitOffs>48</BitOffs><Flags><Access>rw</Access></Flags></SubItem>
     </DataType>
     <DataType><Name>DT2020ARR</Name><BaseType>UINT</BaseType><BitSize>48</BitSize>
      <ArrayInfo><LBound>1</LBound><Elements>3</Elements></ArrayInfo></DataType>
     <DataType><Name>DT2020</Name><BitSize>64</BitSize>
      <SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type>
       <BitSize>8</BitSize></SubItem>
      <SubItem><Name>Elements</Name><Type>DT2020ARR</Type><BitSize>48</BitSize>
       <Flags><Access>rw</Access></Flags></SubItem></DataType>
     <DataType><Name>DT0800EN16</Name><BaseType>UINT</BaseType><BitSize>16</BitSize>
      <EnumInfo><Text>Off</Text><Enum>0</Enum></EnumInfo>
      <EnumInfo><Text LcId="1031">An</Text><Text LcId="1033">On</Text><Enum>#x1</Enum></EnumInfo>
     </DataType>
    </DataTypes>
    <Objects>
     <Object><Index>#x2000</Index><Name>Switch</Name><Type>DT0800EN16</Type><BitSize>16</BitSize>
      <Info><DefaultData>0100</DefaultData></Info><Flags><Access>rw</Access></Flags></Object>
     <Object><Index>#x2001</Index><Name>Ramp</Name><Type>INT</Type><BitSize>16</BitSize>
      <Info><DefaultValue>-5</DefaultValue><MinValue>-10</MinValue><MaxValue>10</MaxValue>
       <Unit>#xFD030000</Unit></Info><Flags><Access>rw</Access></Flags></Object>
     <Object><Index>#x2020</Index><Name>Table</Name><Type>DT2020</Type><BitSize>64</BitSize>
      <Flags><Access>rw</Access></Flags></Object>
     <Object><Index>#x6040</Index><Name>Controlword</Name><Type>UINT</Type><BitSize>16</BitSize>
      <Flags><Access>rw</Access><PdoMapping>R</PdoMapping></Flags></Object>
     <Object><Index>#x6041</Index><Name>Statusword</Name><Type>UINT</Type><BitSize>16</BitSize>
      <Flags><Access>ro</Access><PdoMapping>T</PdoMapping></Flags></Object>
     <Object><Index>#x6099</Index><Name>Homing speeds</Name><Type>DT6099</Type>
      <BitSize>80</BitSize><Info><SubItem><Name>SubIndex 000</Name>
       <Info><DefaultData>02</DefaultData></Info></SubItem>
       <SubItem><Name>Speed for switch</Name><Info><DefaultData>E8030000</DefaultData></Info>
       </SubItem></Info><Flags><Access>rw</Access></Flags></Object>
    </Objects></Dictionary></Profile>
   <RxPdo Sm="2"><Index>#x1600</Index><Name>Out</Name>
    <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Control</Name>
     <DataType>UINT</DataType></Entry>
    <Entry><Index>0</Index><BitLen>8</BitLen></Entry>
    <Entry><Index>#x607A</Index><SubIndex>0</SubIndex><BitLen>32</BitLen><Name></Name>
     <DataType>UDINT</DataType></Entry></RxPdo>
   <TxPdo Sm="3" Fixed="true"><Index>#x1A00</Index><Name>In</Name>
    <Entry><Index>#x6041</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Status</Name>
     <DataType>UINT</DataType></Entry></TxPdo>
   <Mailbox><CoE SdoInfo="1" CompleteAccess="true"/><FoE/></Mailbox>
  </Device>
  <Device><Type ProductCode="#x00000191" RevisionNo="#x1">ES5</Type><Name>Drive ES5</Name>
   <RxPdo><Index>#x1600</Index><Entry><Index>#x6040</Index><SubIndex>0</SubIndex>
    <BitLen>16</BitLen><Name>Control</Name><DataType>UINT16</DataType></Entry></RxPdo></Device>
 </Devices></Descriptions>
</EtherCATInfo>
"""
