#!/bin/sh
# Give dxf2gcode the settings of examples/inlay.nc: depths, feeds, and a tool change without M6.
# Usage: sh dxf2gcode.sh CONFIG_DIRECTORY    normally ~/.config/dxf2gcode, which dxf2gcode makes at its first start
set -eu
set_value() { # FILE KEY VALUE
    sed -i "s|^\( *$2\) = .*|\1 = $3|" "$1"
}
config="$1/config/config.cfg"
set_value "$config" axis3_retract 5.0
set_value "$config" axis3_safe_margin 0.5
set_value "$config" axis3_start_mill_depth 0.0
set_value "$config" axis3_slice_depth -0.7
set_value "$config" axis3_mill_depth -2.1
set_value "$config" f_g1_plane 700.0
set_value "$config" f_g1_depth 200.0
set_value "$config" default_TSP True
set_value "$1/postpro_config/postpro_config.cfg" tool_change '"T%tool_nr%nlS%speed%nl"'
