# ESP-IDF reads a component's CMakeLists.txt twice: first as a script, `cmake -P`, to learn what it requires. What a
# script may not do fails there. This is that first reading: cmake -DCOMPONENT=folder -P components.cmake
macro(idf_component_register)
    cmake_parse_arguments(said "" "" "SRCS;INCLUDE_DIRS;PRIV_REQUIRES;REQUIRES;LDFRAGMENTS" ${ARGN})
    foreach(path IN LISTS said_SRCS said_INCLUDE_DIRS said_LDFRAGMENTS)
        get_filename_component(path "${path}" ABSOLUTE BASE_DIR "${COMPONENT}")
        message(STATUS "path ${path}")
    endforeach()
    return()
endmacro()

function(read_component)
    set(CMAKE_CURRENT_LIST_DIR "${COMPONENT}")
    include("${COMPONENT}/CMakeLists.txt")
endfunction()

read_component()
