# The folders of src/tpm, each a library of objects, so that a library can be put together of folders
# compiled in one way and folders compiled in another.
set(TPM_PRIVATE_LIBRARIES tpm_ceres tpm_sundials tpm_hdf5 tpm_muparser tpm_csv tpm_deflate tpm_minizip tpm_httplib
    tpm_metis OpenSSL::Crypto Threads::Threads TBB::tbb ZLIB::ZLIB ${CMAKE_DL_LIBS}
    $<$<BOOL:${TPM_MPI}>:$<LINK_ONLY:MPI::MPI_C>>)

function(tpm_folder_options target)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/include)
  target_link_libraries(${target} PRIVATE Eigen3::Eigen nlohmann_json::nlohmann_json fmt::fmt
                                          ${TPM_PRIVATE_LIBRARIES} tpm_header_only tpm_options)
  target_compile_definitions(${target} PRIVATE TPM_VERSION="${PROJECT_VERSION}"
    TPM_SOURCE_SHARE="${PROJECT_SOURCE_DIR}"
    TPM_INSTALL_SHARE="${CMAKE_INSTALL_FULL_DATADIR}/tpmkit")
  target_compile_options(${target} PRIVATE ${ARGN})
  # One compilation serves the program, the shared library of the C interface and the Python module.
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -fno-semantic-interposition)
endfunction()

# tpm_folders(SUFFIX FLAGS FOLDER...): targets tpm_folder_FOLDER+SUFFIX with these flags; their objects
# are listed in TPM_FOLDER_OBJECTS.
function(tpm_folders suffix flags)
  # Loops over lanes become vectors: they are marked, and nobody reads errno after a square root there.
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/tpm/organ/balance/lane_bonds.cpp
    ${PROJECT_SOURCE_DIR}/src/tpm/organ/linear/lanes.cpp
    PROPERTIES COMPILE_OPTIONS "-fno-math-errno;-fopenmp-simd" SKIP_PRECOMPILE_HEADERS ON
               SKIP_UNITY_BUILD_INCLUSION ON)
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/tpm/haptics/session/page_server.cpp
    PROPERTIES COMPILE_OPTIONS "${TPM_HTTPLIB_CFLAGS_OTHER}" SKIP_PRECOMPILE_HEADERS ON
               SKIP_UNITY_BUILD_INCLUSION ON)
  set(objects)
  foreach(way fast arranging)
    set(carrier tpm_folder_headers_${way}${suffix})
    set(own_flags ${flags})
    if(way STREQUAL arranging)
      list(APPEND own_flags ${TPM_ARRANGING_FLAGS})
    endif()
    if(TPM_COMMON_HEADERS)  # headers that most files include are read once for each way
      file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${carrier}.cpp CONTENT "")
      add_library(${carrier} OBJECT ${CMAKE_BINARY_DIR}/${carrier}.cpp)
      tpm_folder_options(${carrier} ${own_flags})
      tpm_common_headers(${carrier} <algorithm> <cmath> <filesystem> <map> <optional> <span> <string> <vector>
                         <Eigen/Core> <fmt/format.h>)
    endif()
    foreach(folder IN LISTS ARGN)
      if((folder IN_LIST TPM_ARRANGING_FOLDERS AND way STREQUAL fast) OR
         (NOT folder IN_LIST TPM_ARRANGING_FOLDERS AND way STREQUAL arranging))
        continue()
      endif()
      file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/tpm/${folder}/*.cpp)
      foreach(component "" ${TPM_COMPONENTS})  # sources of another component than their folder's
        set(target tpm_folder_${folder}${suffix})
        set(own ${sources})
        if(component)
          string(APPEND target _of_${component})
          set(own ${TPM_${component}_OF_${folder}})
          list(TRANSFORM own PREPEND ${PROJECT_SOURCE_DIR}/src/tpm/${folder}/)
          list(TRANSFORM own APPEND .cpp)
        else()
          foreach(other IN LISTS TPM_COMPONENTS)
            foreach(source IN LISTS TPM_${other}_OF_${folder})
              list(REMOVE_ITEM own ${PROJECT_SOURCE_DIR}/src/tpm/${folder}/${source}.cpp)
            endforeach()
          endforeach()
        endif()
        if(NOT own)
          continue()
        endif()
        add_library(${target} OBJECT ${own})
        tpm_folder_options(${target} ${own_flags})
        tpm_compile_together(${target})
        if(TPM_MPI AND folder STREQUAL sweep)  # only this folder speaks to other processes
          target_compile_definitions(${target} PRIVATE TPM_MPI OMPI_SKIP_MPICXX MPICH_SKIP_MPICXX)
          target_link_libraries(${target} PRIVATE MPI::MPI_C)
        endif()
        if(TPM_COMMON_HEADERS)
          target_precompile_headers(${target} REUSE_FROM ${carrier})
        endif()
        list(APPEND objects $<TARGET_OBJECTS:${target}>)
      endforeach()
    endforeach()
  endforeach()
  set(TPM_FOLDER_OBJECTS ${objects} PARENT_SCOPE)
endfunction()

# tpm_list(LIST FUNCTION HEADER TYPE NAMESPACE NOUN FILE...): writes a source in which FUNCTION lists the objects of files.
# A file NAME.cpp defines the function NAMESPACE::NAME_NOUN(), which returns TYPEs, a span of pointers to const TYPE.
function(tpm_list list function header type namespace noun)
  set(declared "")
  set(called "")
  foreach(source IN LISTS ARGN)
    get_filename_component(name ${source} NAME_WE)
    string(APPEND declared "${type}s ${name}_${noun}();\n")
    list(APPEND called "${namespace}::${name}_${noun}()")
  endforeach()
  list(JOIN called ", " called)
  file(CONFIGURE OUTPUT ${list} @ONLY CONTENT [[
// Written by the build.
#include "@header@"

namespace @namespace@ {

@declared@
}  // namespace @namespace@

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
  tpm_list(${list} ${function} tpmkit/formulation.hpp Formulation tpm::organ formulations ${ARGN})
endfunction()
function(tpm_shape_list list function)
  tpm_list(${list} ${function} tpmkit/elongation_function.hpp ElongationShape tpm elongation_shapes ${ARGN})
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

set(TPM_SANITIZED_FOLDERS core store protocol material solve model law network curve scene simulate method
    reduce device servo haptics sample fit study CACHE STRING "Folders under address and undefined in sanitized copies")

# A copy of the library in which the folders named run under sanitizers; the others are those of
# tpmkit. The fast tests, compiled once, run with tpmkit and with the copy. A folder's own inline
# functions stay its own (-Bsymbolic-functions), or those of the tests would take their place.
function(tpm_sanitized_copy copy sanitize)
  set(flags -fsanitize=${sanitize} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1 -Wno-maybe-uninitialized)
  if(sanitize MATCHES "address" AND sanitize MATCHES "undefined")
    list(APPEND flags -fno-sanitize=null,alignment,object-size,vptr -DEIGEN_MALLOC_ALREADY_ALIGNED=1)
    # for both see TpmCompileOptions.cmake
  endif()
  tpm_folders(_${copy} "${flags}" ${ARGN})
  set(rest ${TPM_FOLDERS})
  list(REMOVE_ITEM rest ${ARGN})
  foreach(folder IN LISTS rest)
    foreach(target tpm_folder_${folder} tpm_folder_${folder}_of_core tpm_folder_${folder}_of_organ tpm_folder_${folder}_of_fit
            tpm_folder_${folder}_of_haptics)
      if(TARGET ${target})
        list(APPEND TPM_FOLDER_OBJECTS $<TARGET_OBJECTS:${target}>)
      endif()
    endforeach()
  endforeach()
  add_library(${copy} SHARED ${TPM_FOLDER_OBJECTS} ${TPM_LISTS})
  set_target_properties(${copy} PROPERTIES LINKER_LANGUAGE CXX OUTPUT_NAME tpmkit_${copy})
  target_link_options(${copy} PUBLIC -fsanitize=${sanitize} PRIVATE -Wl,-Bsymbolic-functions)
  target_link_libraries(${copy} PRIVATE fmt::fmt ${TPM_PRIVATE_LIBRARIES})
endfunction()
