# A room: a folder of src/tpm that is one library, one namespace, one installed component and one label of the tests.
# tpm_room(ROOM [NEEDS ROOM...] [LINKS LIBRARY...]): what a room includes, and what it links beside. A room needs only
# rooms named before it; docs/architecture.md says what each is for.
set(TPM_ROOMS)
macro(tpm_room room)
  cmake_parse_arguments(TPM_ROOM "" "" "NEEDS;LINKS" ${ARGN})
  foreach(need IN LISTS TPM_ROOM_NEEDS)
    if(NOT need IN_LIST TPM_ROOMS)
      message(FATAL_ERROR "room ${room} needs ${need}; expected a room named before it: ${TPM_ROOMS}")
    endif()
  endforeach()
  list(APPEND TPM_ROOMS ${room})
  set(TPM_NEEDS_${room} ${TPM_ROOM_NEEDS})
  set(TPM_LINKS_${room} ${TPM_ROOM_LINKS})
endmacro()

# Folders that only arrange and write: they are optimised little (TPM_ARRANGING_FLAGS), for the compiler's time.
set(TPM_ARRANGING accuracy accuracy/show accuracy/stability accuracy/verify fit/design fit/expression fit/groups fit/online
    fit/predict fit/recording fit/select fit/show haptics/boundary haptics/formulations haptics/serve haptics/session
    haptics/show haptics/verify organ/scene paper paper/claims paper/show plan plan/formulations plan/show show sweep/show)
# Those that are not optimised either in copies under sanitizers, or where TPM_QUICK_TO_BUILD asks for it.
set(TPM_ARRANGING_QUICKLY data files files/blocks files/hdf5 files/import organ/run)

# tpm_folders_of(LIST ROOM): the folders of a room that hold sources, as ROOM or ROOM/FOLDER.
function(tpm_folders_of list room)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/src/tpm ${PROJECT_SOURCE_DIR}/src/tpm/${room}/*.cpp)
  set(folders)
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH folder)
    list(APPEND folders ${folder})
  endforeach()
  list(REMOVE_DUPLICATES folders)
  if(NOT folders)
    message(FATAL_ERROR "src/tpm/${room} holds no source")
  endif()
  set(${list} ${folders} PARENT_SCOPE)
endfunction()

# tpm_reach(LIST ROOM): a room and all that it needs, directly or not, the latest first, as a linker reads archives.
function(tpm_reach list room)
  set(reached ${room})
  foreach(need IN LISTS TPM_NEEDS_${room})
    tpm_reach(below ${need})
    list(APPEND reached ${below})
  endforeach()
  set(ordered)
  foreach(other IN LISTS TPM_ROOMS)
    if(other IN_LIST reached)
      list(PREPEND ordered ${other})
    endif()
  endforeach()
  set(${list} ${ordered} PARENT_SCOPE)
endfunction()

# What a source of a room is compiled with: its own libraries and those of the rooms it reaches, no others.
function(tpm_room_options target room)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
  tpm_reach(reached ${room})
  target_link_libraries(${target} PRIVATE Eigen3::Eigen fmt::fmt tpm_header_only tpm_options)
  if("files" IN_LIST reached)
    target_link_libraries(${target} PRIVATE nlohmann_json::nlohmann_json)
  endif()
  foreach(other IN LISTS reached)
    target_link_libraries(${target} PRIVATE ${TPM_LINKS_${other}})
  endforeach()
  target_compile_definitions(${target} PRIVATE TPM_VERSION="${PROJECT_VERSION}"
    TPM_SOURCE_SHARE="${PROJECT_SOURCE_DIR}"
    TPM_INSTALL_SHARE="${CMAKE_INSTALL_FULL_DATADIR}/tpmkit")
  # One compilation serves the program, the shared library of the C interface and the Python module.
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -fno-semantic-interposition ${ARGN})
endfunction()

# tpm_room_objects(LIST ROOM NAME SUFFIX FLAGS FOLDER...): the objects of folders of a room, compiled with these flags. Those
# that only arrange are one target, the others another: files of several folders are compiled together.
function(tpm_room_objects list room name suffix flags)
  # Loops over lanes become vectors: they are marked, and nobody reads errno after a square root there.
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/tpm/organ/balance/lane_bonds.cpp
    ${PROJECT_SOURCE_DIR}/src/tpm/organ/linear/lanes.cpp
    PROPERTIES COMPILE_OPTIONS "-fno-math-errno;-fopenmp-simd" SKIP_PRECOMPILE_HEADERS ON
               SKIP_UNITY_BUILD_INCLUSION ON)
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/tpm/haptics/session/page_server.cpp
    PROPERTIES COMPILE_OPTIONS "${TPM_HTTPLIB_CFLAGS_OTHER}" SKIP_PRECOMPILE_HEADERS ON
               SKIP_UNITY_BUILD_INCLUSION ON)
  set(arranging ${TPM_ARRANGING})
  set(arranging_flags ${TPM_ARRANGING_FLAGS})
  if(suffix OR TPM_QUICK_TO_BUILD)
    list(APPEND arranging ${TPM_ARRANGING_QUICKLY})
    set(arranging_flags -O0)
  endif()
  set(sources_fast)
  set(sources_arranging)
  foreach(folder IN LISTS ARGN)
    file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/tpm/${folder}/*.cpp)
    if(folder IN_LIST arranging)
      list(APPEND sources_arranging ${sources})
    else()
      list(APPEND sources_fast ${sources})
    endif()
  endforeach()
  set(objects)
  foreach(way fast arranging)
    if(NOT sources_${way})
      continue()
    endif()
    set(own_flags ${flags})
    if("${way}" STREQUAL "arranging")  # in quotes: arranging is a variable, too
      list(APPEND own_flags ${arranging_flags})
    endif()
    set(carrier tpm_room_headers_${way}${suffix})
    if(TPM_COMMON_HEADERS AND NOT TARGET ${carrier})  # headers that most files include are read once for each way
      file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${carrier}.cpp CONTENT "")
      add_library(${carrier} OBJECT ${CMAKE_BINARY_DIR}/${carrier}.cpp)
      tpm_room_options(${carrier} base ${own_flags})
      tpm_common_headers(${carrier} <algorithm> <cmath> <filesystem> <map> <optional> <span> <string> <vector>
                         <Eigen/Core> <fmt/format.h>)
    endif()
    set(target tpm_objects_${name}_${way}${suffix})
    add_library(${target} OBJECT ${sources_${way}})
    tpm_room_options(${target} ${room} ${own_flags})
    tpm_compile_together(${target} 36)
    if(TPM_MPI AND room STREQUAL sweep)  # only this room speaks to other processes
      target_compile_definitions(${target} PRIVATE TPM_MPI OMPI_SKIP_MPICXX MPICH_SKIP_MPICXX)
    endif()
    if(TPM_COMMON_HEADERS)
      target_precompile_headers(${target} REUSE_FROM ${carrier})
    endif()
    list(APPEND objects $<TARGET_OBJECTS:${target}>)
  endforeach()
  set(${list} ${objects} PARENT_SCOPE)
endfunction()

# --- lists ------------------------------------------------------------------------------------------

# tpm_list(LIST FUNCTION HEADER TYPE NOUN FILE...): writes a source in which FUNCTION lists the objects of files.
# A file ROOM/.../NAME.cpp defines the function tpm::ROOM::NAME_NOUN(), which returns TYPEs, a span of pointers to const
# TYPE; a file outside src/tpm defines it in tpm.
function(tpm_list list function header type noun)
  set(declared "")
  set(called "")
  foreach(source IN LISTS ARGN)
    cmake_path(GET source STEM name)
    set(space tpm)
    if(source MATCHES "^${PROJECT_SOURCE_DIR}/src/tpm/([a-z]+)/")
      set(space tpm::${CMAKE_MATCH_1})
    endif()
    string(APPEND declared "namespace ${space} {\n${type}s ${name}_${noun}();\n}\n")
    list(APPEND called "${space}::${name}_${noun}()")
  endforeach()
  list(JOIN called ", " called)
  file(CONFIGURE OUTPUT ${list} @ONLY CONTENT [[
// Written by the build.
#include "@header@"

@declared@
namespace tpm {

@type@s @function@() {
  static const std::vector<const @type@*> all = joined({@called@});
  return all;
}

}  // namespace tpm
]])
endfunction()
# Of formulations: NAME_formulations(); of the shapes of materials: NAME_elongation_shapes().
function(tpm_formulation_list list function)
  tpm_list(${list} ${function} tpmkit/formulation.hpp Formulation formulations ${ARGN})
endfunction()
function(tpm_shape_list list function)
  tpm_list(${list} ${function} tpmkit/elongation_function.hpp ElongationShape elongation_shapes ${ARGN})
endfunction()

# tpm_shipped(SOURCE HEADER TYPE NOUN): writes a source in which NOUN() answers what is shipped.
function(tpm_shipped source header type noun)
  file(CONFIGURE OUTPUT ${source} @ONLY CONTENT [[
// Written by the build: a program that defines this function itself has others.
#include "@header@"

namespace tpm {

@type@ @noun@() {
  return shipped_@noun@();
}

}  // namespace tpm
]])
endfunction()

# Which formulations there are: a list of those shipped, and a source of its own that hands it out, so that a program can
# be linked with another list, which may hold the shipped ones as well. The room plan has the list of its own
# formulations, for scenes; haptics, which knows all, that of all. The shapes of materials are those of the room law.
file(GLOB TPM_PLAN_FORMULATIONS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/tpm/plan/formulations/*.cpp)
file(GLOB TPM_HAPTICS_FORMULATIONS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/tpm/haptics/formulations/*.cpp)
file(GLOB TPM_SHAPE_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/tpm/law/shapes/*.cpp)
set(TPM_FORMULATION_SOURCES ${TPM_PLAN_FORMULATIONS} ${TPM_HAPTICS_FORMULATIONS})
tpm_formulation_list(${CMAKE_BINARY_DIR}/formulations_of_plan.cpp shipped_formulations ${TPM_PLAN_FORMULATIONS})
tpm_formulation_list(${CMAKE_BINARY_DIR}/formulations_of_haptics.cpp shipped_formulations ${TPM_FORMULATION_SOURCES})
tpm_shape_list(${CMAKE_BINARY_DIR}/shapes_of_law.cpp shipped_elongation_shapes ${TPM_SHAPE_SOURCES})
tpm_shipped(${CMAKE_BINARY_DIR}/formulations.cpp tpmkit/formulation.hpp Formulations formulations)
tpm_shipped(${CMAKE_BINARY_DIR}/shapes.cpp tpmkit/elongation_function.hpp ElongationShapes elongation_shapes)
set(TPM_LIST_OF_law ${CMAKE_BINARY_DIR}/shapes_of_law.cpp ${CMAKE_BINARY_DIR}/shapes.cpp)
set(TPM_LIST_OF_plan ${CMAKE_BINARY_DIR}/formulations_of_plan.cpp ${CMAKE_BINARY_DIR}/formulations.cpp)
set(TPM_LIST_OF_haptics ${CMAKE_BINARY_DIR}/formulations_of_haptics.cpp ${CMAKE_BINARY_DIR}/formulations.cpp)

# --- libraries --------------------------------------------------------------------------------------

# tpm_rooms(): of each room the library tpm_room_ROOM, and tpmkit, which links all. TPM_ROOM_LIBRARIES has them, the latest
# first; TPM_OBJECTS_OF_ROOM a room's objects, TPM_OUTER_OF_ROOM those of folders that copies under sanitizers leave out.
macro(tpm_rooms)
  set(TPM_ROOM_LIBRARIES)
  foreach(room IN LISTS TPM_ROOMS)
    tpm_folders_of(TPM_FOLDERS_${room} ${room})
    set(TPM_OUTER_FOLDERS ${TPM_FOLDERS_${room}})
    list(FILTER TPM_OUTER_FOLDERS INCLUDE REGEX "/(show|shapes|formulations)$")
    list(REMOVE_ITEM TPM_FOLDERS_${room} ${TPM_OUTER_FOLDERS})
    tpm_room_objects(TPM_OBJECTS_OF_${room} ${room} ${room} "" "" ${TPM_FOLDERS_${room}})
    tpm_room_objects(TPM_OUTER_OF_${room} ${room} ${room}_outer "" "" ${TPM_OUTER_FOLDERS})
    set(TPM_ALL_OF_${room} ${TPM_OBJECTS_OF_${room}} ${TPM_OUTER_OF_${room}})
    if(TPM_LIST_OF_${room})
      add_library(tpm_list_of_${room} OBJECT ${TPM_LIST_OF_${room}})
      tpm_room_options(tpm_list_of_${room} ${room})
      list(APPEND TPM_ALL_OF_${room} $<TARGET_OBJECTS:tpm_list_of_${room}>)
    endif()
    set(TPM_ROOM_TARGET tpm_room_${room})
    add_library(${TPM_ROOM_TARGET} ${TPM_ALL_OF_${room}})
    set(TPM_ROOM_NAME tpmkit_${room})
    if(room STREQUAL haptics)  # libtpmkit_haptics is the library of the C interface
      set(TPM_ROOM_NAME tpmkit_haptics_cpp)
    endif()
    set_target_properties(${TPM_ROOM_TARGET} PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME ${TPM_ROOM_NAME} EXPORT_NAME ${room})
    target_include_directories(${TPM_ROOM_TARGET} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                                         $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
                                                  INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>)
    target_compile_features(${TPM_ROOM_TARGET} INTERFACE cxx_std_20)
    target_link_libraries(${TPM_ROOM_TARGET} PUBLIC Eigen3::Eigen fmt::fmt)
    foreach(need IN LISTS TPM_NEEDS_${room})
      target_link_libraries(${TPM_ROOM_TARGET} PUBLIC tpm_room_${need})
    endforeach()
    target_link_libraries(${TPM_ROOM_TARGET} PRIVATE ${TPM_LINKS_${room}})
    if(room STREQUAL files)
      target_link_libraries(${TPM_ROOM_TARGET} INTERFACE $<BUILD_INTERFACE:nlohmann_json::nlohmann_json>
                                                         $<BUILD_INTERFACE:tpm_header_only>)
    endif()
    # Rooms below ask for the list by a weak reference, which takes nothing out of an archive.
    if(room STREQUAL plan OR room STREQUAL haptics)
      target_link_options(${TPM_ROOM_TARGET} INTERFACE LINKER:--undefined=_ZN3tpm12formulationsEv)
    endif()
    if(BUILD_SHARED_LIBS AND NOT TPM_SANITIZE)
      target_link_options(${TPM_ROOM_TARGET} PRIVATE LINKER:-z,defs)
      tpm_reach(TPM_REACHED ${room})  # templates in headers of the rooms below call the libraries of those
      foreach(other IN LISTS TPM_REACHED)
        target_link_libraries(${TPM_ROOM_TARGET} PRIVATE ${TPM_LINKS_${other}})
      endforeach()
    endif()
    list(PREPEND TPM_ROOM_LIBRARIES ${TPM_ROOM_TARGET})
  endforeach()
  get_target_property(TPM_GIVEN_FLAGS tpm_objects_organ_arranging COMPILE_OPTIONS)
  if(NOT "${TPM_ARRANGING_FLAGS}" IN_LIST TPM_GIVEN_FLAGS)
    message(FATAL_ERROR "organ/scene is not compiled with ${TPM_ARRANGING_FLAGS}, but with ${TPM_GIVEN_FLAGS}")
  endif()
  add_library(tpmkit INTERFACE)
  add_library(tpmkit::tpmkit ALIAS tpmkit)
  target_link_libraries(tpmkit INTERFACE ${TPM_ROOM_LIBRARIES})
  if(BUILD_SHARED_LIBS)  # a weak reference alone does not keep the library of haptics, whose list is the longest
    target_link_options(tpmkit INTERFACE LINKER:--no-as-needed)
  endif()
endmacro()

# Rooms whose public headers are installed, with those that they need: each an archive with an export of its own. The
# target installed_rooms builds them.
set(TPM_INSTALLED_ROOMS base work data law files show organ contact plan fit haptics)
function(tpm_install_rooms)
  foreach(room IN LISTS TPM_INSTALLED_ROOMS)
    install(TARGETS tpm_room_${room} EXPORT tpmkit-${room}
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
    install(EXPORT tpmkit-${room} NAMESPACE tpmkit:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tpmkit
            COMPONENT development)
  endforeach()
  add_custom_target(installed_rooms)
  list(TRANSFORM TPM_INSTALLED_ROOMS PREPEND tpm_room_ OUTPUT_VARIABLE targets)
  add_dependencies(installed_rooms ${targets})
endfunction()

# --- copies under sanitizers ------------------------------------------------------------------------

# Rooms under address and undefined in the copy: those that read input, keep memory by hand, solve, or run in the servo
# loop; their folders show, shapes and formulations are left out.
set(TPM_SANITIZED_ROOMS base work data law files organ contact haptics CACHE STRING
    "Rooms under address and undefined in sanitized copies")

# A copy of the library in which the rooms named run under sanitizers; the others are those of
# tpmkit. The fast tests of these rooms, compiled once, run with tpmkit and with the copy. A folder's own inline
# functions stay its own (-Bsymbolic-functions), or those of the tests would take their place.
function(tpm_sanitized_copy copy sanitize)
  set(flags -fsanitize=${sanitize} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1 -Wno-maybe-uninitialized
    -Wno-stringop-overflow)  # of what g++ 12 takes for overflows of std::string (GCC bug 105329)
  if(sanitize MATCHES "address" AND sanitize MATCHES "undefined")
    list(APPEND flags -fno-sanitize=null,alignment,object-size,vptr -DEIGEN_MALLOC_ALREADY_ALIGNED=1)
    # for both see TpmCompileOptions.cmake
  endif()
  set(all)
  set(count 0)
  foreach(room IN LISTS TPM_ROOMS)
    if(room IN_LIST ARGN)
      tpm_room_objects(objects ${room} ${room} _${copy} "${flags}" ${TPM_FOLDERS_${room}})
      foreach(folder IN LISTS TPM_FOLDERS_${room})
        file(GLOB sources ${PROJECT_SOURCE_DIR}/src/tpm/${folder}/*.cpp)
        list(LENGTH sources more)
        math(EXPR count "${count} + ${more}")
      endforeach()
    else()
      set(objects ${TPM_OBJECTS_OF_${room}})
    endif()
    list(APPEND all ${objects} ${TPM_OUTER_OF_${room}})
  endforeach()
  message(STATUS "Sanitized copy ${copy}: ${count} sources")
  add_library(${copy} SHARED ${all} $<TARGET_OBJECTS:tpm_list_of_law> $<TARGET_OBJECTS:tpm_list_of_haptics>)
  set_target_properties(${copy} PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME tpmkit_${copy})
  target_link_options(${copy} PUBLIC -fsanitize=${sanitize} PRIVATE -Wl,-Bsymbolic-functions)
  target_link_libraries(${copy} PRIVATE fmt::fmt)
  foreach(room IN LISTS TPM_ROOMS)
    target_link_libraries(${copy} PRIVATE ${TPM_LINKS_${room}})
  endforeach()
endfunction()
