#!/bin/sh
# Draw a guilloche of rotated ellipses with vpype and write it as G-code. Usage: sh plot.sh OUTPUT.nc
set -eu
vpype --config "$(dirname "$0")/plotter.toml" \
    pagesize --landscape 200mmx170mm begin repeat 40 ellipse --quantization 0.12mm 100mm 70mm 62mm 21mm \
    rotate --origin 100mm 70mm "%_i*4.5%" end \
    circle --quantization 0.12mm 100mm 70mm 64mm circle --quantization 0.12mm 100mm 70mm 66mm \
    text --font timesrb --size 12mm --align center --position 100mm 150mm "WiFiCNC" \
    linemerge --tolerance 0.05mm linesimplify --tolerance 0.015mm linesort \
    gwrite --profile pen "$1"
