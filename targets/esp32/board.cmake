# Options of all our own code, pin_config.h of the board, page_files.h of the page that the firmware carries, and
# signing_key.h, whose key signs its updates.
#
# The board is WIFICNC_BOARD (of CMake or of the environment); without one, the chip's first board. `wificnc dev pins`,
# `page` and `signing-key` write the headers into the build directory, and only when they change.
#
# A larger stack frame is an error: cli/wificnc/build/frames.py has the limit of each file, this is the largest.
set(wificnc_options -ffp-contract=off -fno-math-errno -fno-jump-tables -Werror=frame-larger-than=4096)

# CONFIG_APP_REPRODUCIBLE_BUILD names the project's folder alike everywhere. `idf.py` has targets/esp32 as project, and
# core, targets/chip and targets/net lie outside: debug information had their folder, and the image has the ELF's sum
get_filename_component(wificnc_root "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)
list(APPEND wificnc_options "-fdebug-prefix-map=${wificnc_root}=/WIFICNC" "-fmacro-prefix-map=${wificnc_root}=.")

if(NOT WIFICNC_BOARD)
    set(WIFICNC_BOARD "$ENV{WIFICNC_BOARD}")
endif()
if(NOT WIFICNC_BOARD AND IDF_TARGET STREQUAL "esp32")
    set(WIFICNC_BOARD esp32-wroom32)
elseif(NOT WIFICNC_BOARD)
    set(WIFICNC_BOARD esp32s3-devkitc)
endif()

set(wificnc_pins "${CMAKE_BINARY_DIR}/wificnc")
find_program(WIFICNC_COMMAND wificnc)
if(NOT WIFICNC_COMMAND)
    message(FATAL_ERROR "wificnc is not on the PATH: run `pip install -e .` in the repository, then build again")
endif()
function(wificnc_generate)
    execute_process(COMMAND "${WIFICNC_COMMAND}" dev ${ARGV} RESULT_VARIABLE failed)
    if(failed)
        list(JOIN ARGV " " said)
        message(FATAL_ERROR "wificnc dev ${said} failed, see above")
    endif()
endfunction()
wificnc_generate(pins "${WIFICNC_BOARD}" -o "${wificnc_pins}/pin_config.h")
wificnc_generate(page --board "${WIFICNC_BOARD}" -o "${wificnc_pins}/page_files.h")
wificnc_generate(signing-key -o "${wificnc_pins}/signing_key.h")

# Interrupts have their time in debug builds, too
set(wificnc_fast ${sources})
list(FILTER wificnc_fast INCLUDE REGEX "/(step/(control|isr|position)|machine/inputs|base/debounce|(hal|chip)/[a-z_]+|io/(inputs|encoder))[.]c$")
set_source_files_properties(${wificnc_fast} PROPERTIES COMPILE_OPTIONS "-O2;-fno-stack-protector")

# What hal/step_vector.S calls has the call0 ABI, and no loop registers. The assembler's note of it would have the linker
# warn of two ABIs in one image
set(wificnc_call0 ${sources})
list(FILTER wificnc_call0 INCLUDE REGEX "/(step/isr|hal/step_interrupt)[.]c$")
set_source_files_properties(${wificnc_call0} PROPERTIES COMPILE_OPTIONS
    "-O2;-fno-stack-protector;-mabi=call0;-fno-branch-count-reg;-Wa,--abi-windowed")

target_include_directories(${COMPONENT_LIB} PRIVATE "${wificnc_pins}")
