"""The maker's calibration files of two transducers, as published."""

from drivers.calibration_file import parse_calibration_file

# FT32831, Nano43 SI-36-0.5, calibrated 12/14/2020: the file's own numbers.
NANO43 = """<?xml version="1.0" encoding="utf-8"?>
<!-- a comment -->
<FTSensor Serial="FT32831" BodyStyle="Nano43" Family="DAQ" NumGages="6" CalFileVersion="1.1">
 <Calibration PartNumber="SI-36-0.5" CalDate="12/14/2020" ForceUnits="N" TorqueUnits="N-mm" DistUnits="mm"
   OutputMode="Ground Referenced Differential" OutputRange="20" HWTempComp="True" GainMultiplier="1">
 <Axis Name="Fx" values="0.17124 -0.23480 -0.42753 36.86148 -0.44469 -36.43208" max="36" scale="8.1634377013728"/>
 <Axis Name="Fy" values="-1.11998 -41.82688 -0.34426 21.11841 0.32722 20.58933" max="36" scale="8.1634377013728"/>
 <Axis Name="Fz" values="20.64039 -0.11474 20.88593 0.15774 20.81387 0.08546" max="36" scale="6.93470571615175"/>
 <Axis Name="Tx" values="-0.17249 -0.69307 36.14830 0.63283 -35.99689 0.26524" max="500" scale="0.825836392458168"/>
 <Axis Name="Ty" values="-41.68215 0.33486 20.86280 -0.56441 20.56406 0.66095" max="500" scale="0.825836392458168"/>
 <Axis Name="Tz" values="-0.72205 -22.00406 0.30563 -21.35581 -0.24436 -21.47014" max="500" scale="0.574757166607079"/>
  <BasicTransform Dx="0" Dy="0" Dz="4.3434" Rx="0" Ry="0" Rz="0"/>
 </Calibration>
</FTSensor>
"""

# Its working matrix [N, N mm per V], worked out independently of this program from the rows above.
NANO43_MATRIX = [
    [0.02098, -0.02876, -0.05237, 4.51544, -0.05447, -4.46284],
    [-0.13719, -5.12368, -0.04217, 2.58695, 0.04008, 2.52214],
    [2.97639, -0.01655, 3.01180, 0.02275, 3.00141, 0.01232],
    [-0.80476, -23.09345, 43.58858, 12.00245, -43.41430, 11.27584],
    [-50.56376, 0.53041, 25.49010, -20.29578, 25.13749, 20.18422],
    [-1.25627, -38.28410, 0.53176, -37.15623, -0.42515, -37.35515],
]

# FT8578, Gamma SI-130-10, calibrated 3/5/2014, in N, N-m and m, with the maker's own product as UserAxis.
GAMMA = """<FTSensor Serial="FT8578" BodyStyle="Gamma" Family="DAQ" NumGages="6" CalFileVersion="1.1">
 <Calibration PartNumber="SI-130-10" CalDate="3/5/2014" ForceUnits="N" TorqueUnits="N-m"
   DistUnits="m" GainMultiplier="1">
 <Axis Name="Fx" values="-0.27053 -0.14278 0.35224 -32.30108 -0.22111 32.83006" max="130" scale="2.33993181642138"/>
 <Axis Name="Fy" values="0.21616 37.46357 0.05722 -18.83819 0.35126 -18.85998" max="130" scale="2.33993181642138"/>
 <Axis Name="Fz" values="18.48980 -0.25078 18.75502 -0.41293 18.60017 -0.58878" max="400" scale="0.747981765296576"/>
 <Axis Name="Tx" values="0.05325 0.15667 -32.28492 0.82744 32.26505 -1.25235" max="10" scale="44.8196831994584"/>
 <Axis Name="Ty" values="37.31421 -0.62445 -18.43472 0.63319 -18.48677 0.60638" max="10" scale="44.8196831994584"/>
 <Axis Name="Tz" values="-0.13536 -18.46474 0.04406 -18.57097 0.27123 -18.80438" max="10" scale="43.1398206760749"/>
  <BasicTransform Dx="0" Dy="0" Dz="0.0120142" Rx="0" Ry="0" Rz="0"/>
 <UserAxis Name="Fx" values="-0.11562 -0.06102 0.15054 -13.80428 -0.09449 14.03035" max="130"/>
 <UserAxis Name="Fy" values="0.09238 16.01054 0.02446 -8.05074 0.15012 -8.06005" max="130"/>
 <UserAxis Name="Fz" values="24.71959 -0.33527 25.07417 -0.55206 24.86714 -0.78715" max="400"/>
 <UserAxis Name="Tx" values="0.00230 0.19585 -0.72004 -0.07826 0.72169 -0.12478" max="10"/>
 <UserAxis Name="Ty" values="0.83393 -0.01320 -0.41312 0.17997 -0.41133 -0.15503" max="10"/>
 <UserAxis Name="Tz" values="-0.00314 -0.42802 0.00102 -0.43048 0.00629 -0.43589" max="10"/>
 </Calibration>
</FTSensor>
"""


def parsed(text):
    return parse_calibration_file(text.encode(), "FT.cal")
