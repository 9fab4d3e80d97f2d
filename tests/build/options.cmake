# Prints the options that targets/esp32/board.cmake of a tree gives to our own code:
# cmake -DTREE=folder -DWIFICNC_COMMAND=a-program-that-succeeds -P options.cmake
function(target_include_directories)
endfunction()
function(set_source_files_properties)
endfunction()
set(IDF_TARGET esp32)
include("${TREE}/targets/esp32/board.cmake")
foreach(option IN LISTS wificnc_options)
    message(STATUS "option ${option}")
endforeach()
