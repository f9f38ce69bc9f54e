# Finds every dependency. Read twice: by the build, and by the installed package (then with
# TPM_CONSUMER set, and TPM_WANTED listing the components), so that nothing installed holds the path of a dependency. Packages whose names
# or targets differ between releases are wrapped in one imported tpm_* target each, so that the
# difference stays in this file.

# In a consumer a missing dependency makes tpmkit "not found", as find_package(tpmkit) promises.
macro(tpm_find)
  if(TPM_CONSUMER)
    find_dependency(${ARGV})
  else()
    find_package(${ARGV} REQUIRED)
  endif()
endmacro()

# --- in the public headers ----------------------------------------------------------------------
tpm_find(Eigen3 3.4 NO_MODULE)
tpm_find(fmt 9)

# --- linked by the component fit ----------------------------------------------------------------
if(NOT TPM_CONSUMER OR "fit" IN_LIST TPM_WANTED)
  tpm_find(Ceres 2.1)
endif()
if((NOT TPM_CONSUMER OR "fit" IN_LIST TPM_WANTED) AND NOT TARGET tpm_ceres)
  add_library(tpm_ceres INTERFACE IMPORTED)
  target_link_libraries(tpm_ceres INTERFACE Ceres::ceres)
endif()

# --- linked by the component haptics --------------------------------------------------------------
if((NOT TPM_CONSUMER OR "haptics" IN_LIST TPM_WANTED) AND NOT TARGET tpm_httplib)
  # The library of httplib (cpp-httplib in Debian, httplib upstream); what it was compiled with changes the layout of its types, so the
  # sources that include its header take the flags of its pkg-config file.
  find_library(TPM_HTTPLIB_LIBRARY NAMES cpp-httplib httplib REQUIRED)
  mark_as_advanced(TPM_HTTPLIB_LIBRARY)
  if(NOT TPM_CONSUMER)
    find_package(PkgConfig REQUIRED)
    pkg_check_modules(TPM_HTTPLIB REQUIRED cpp-httplib>=0.11.4)
  endif()
  add_library(tpm_httplib INTERFACE IMPORTED)
  target_link_libraries(tpm_httplib INTERFACE ${TPM_HTTPLIB_LIBRARY})
endif()

# --- linked by the components files and organ, on which all but base, data and law stand ---------------
if(TPM_CONSUMER AND NOT "files" IN_LIST TPM_WANTED AND NOT "work" IN_LIST TPM_WANTED)
  return()
endif()
tpm_find(SUNDIALS 6.4 COMPONENTS cvodes ida sunmatrixdense sunlinsoldense sunmatrixsparse sunlinsolklu
         nvecserial)
tpm_find(muparser 2.3)
tpm_find(OpenSSL 3 COMPONENTS Crypto)
tpm_find(Threads)
tpm_find(TBB 2021)
tpm_find(ZLIB 1.2)

# libsundials-dev brings the MPI build of HDF5 along, which is not thread safe: the serial one is
# asked for by name, and an MPI one is refused rather than linked silently.
set(HDF5_PREFER_PARALLEL OFF)
set(HDF5_USE_STATIC_LIBRARIES OFF)
if(NOT HDF5_C_COMPILER_EXECUTABLE)
  find_program(HDF5_C_COMPILER_EXECUTABLE NAMES h5cc)
endif()
tpm_find(HDF5 1.10 COMPONENTS C HL)
if(HDF5_IS_PARALLEL)
  message(FATAL_ERROR "HDF5: found the MPI build (${HDF5_C_LIBRARIES}); expected the serial one (Debian: libhdf5-dev)")
endif()
# Its archives, for the program; empty if one is missing. Debian's know Szip through libaec.
set(TPM_HDF5_ARCHIVES)
if(NOT TPM_CONSUMER)
  list(GET HDF5_C_LIBRARIES 0 TPM_HDF5_PLACE)
  cmake_path(GET TPM_HDF5_PLACE PARENT_PATH TPM_HDF5_PLACE)
  foreach(archive libhdf5_hl.a libhdf5.a libsz.a libaec.a)
    find_library(TPM_ARCHIVE_${archive} ${archive} HINTS ${TPM_HDF5_PLACE})
    mark_as_advanced(TPM_ARCHIVE_${archive})
    list(APPEND TPM_HDF5_ARCHIVES ${TPM_ARCHIVE_${archive}})
  endforeach()
  if(TPM_HDF5_ARCHIVES MATCHES "NOTFOUND")
    set(TPM_HDF5_ARCHIVES)
  endif()
endif()
find_path(TPM_CSV_INCLUDE csv.h REQUIRED)
find_library(TPM_CSV_LIBRARY csv REQUIRED)
mark_as_advanced(TPM_CSV_INCLUDE TPM_CSV_LIBRARY)
find_path(TPM_DEFLATE_INCLUDE libdeflate.h REQUIRED)
find_library(TPM_DEFLATE_LIBRARY deflate REQUIRED)
mark_as_advanced(TPM_DEFLATE_INCLUDE TPM_DEFLATE_LIBRARY)
find_path(TPM_MINIZIP_INCLUDE minizip/unzip.h REQUIRED)
find_library(TPM_MINIZIP_LIBRARY minizip REQUIRED)
mark_as_advanced(TPM_MINIZIP_INCLUDE TPM_MINIZIP_LIBRARY)

# METIS 5 has no CMake package; its header says how wide its integers are.
find_path(TPM_METIS_INCLUDE metis.h REQUIRED)
find_library(TPM_METIS_LIBRARY metis REQUIRED)
mark_as_advanced(TPM_METIS_INCLUDE TPM_METIS_LIBRARY)

if(TARGET tpm_sundials)
  return()  # the package was asked for twice
endif()
add_library(tpm_sundials INTERFACE IMPORTED)
target_link_libraries(tpm_sundials INTERFACE SUNDIALS::cvodes SUNDIALS::ida SUNDIALS::nvecserial
  SUNDIALS::sunmatrixdense SUNDIALS::sunlinsoldense SUNDIALS::sunmatrixsparse
  SUNDIALS::sunlinsolklu)
add_library(tpm_hdf5 INTERFACE IMPORTED)
target_include_directories(tpm_hdf5 INTERFACE ${HDF5_INCLUDE_DIRS})
target_link_libraries(tpm_hdf5 INTERFACE ${HDF5_C_HL_LIBRARIES} ${HDF5_C_LIBRARIES})
add_library(tpm_muparser INTERFACE IMPORTED)
target_link_libraries(tpm_muparser INTERFACE muparser::muparser)
add_library(tpm_csv INTERFACE IMPORTED)
target_include_directories(tpm_csv INTERFACE ${TPM_CSV_INCLUDE})
target_link_libraries(tpm_csv INTERFACE ${TPM_CSV_LIBRARY})
add_library(tpm_deflate INTERFACE IMPORTED)
target_include_directories(tpm_deflate INTERFACE ${TPM_DEFLATE_INCLUDE})
target_link_libraries(tpm_deflate INTERFACE ${TPM_DEFLATE_LIBRARY})
add_library(tpm_minizip INTERFACE IMPORTED)
target_include_directories(tpm_minizip INTERFACE ${TPM_MINIZIP_INCLUDE})
target_link_libraries(tpm_minizip INTERFACE ${TPM_MINIZIP_LIBRARY})

add_library(tpm_metis INTERFACE IMPORTED)
target_include_directories(tpm_metis INTERFACE ${TPM_METIS_INCLUDE})
target_link_libraries(tpm_metis INTERFACE ${TPM_METIS_LIBRARY})

# --- headers that only our own sources read, and the program's ----------------------------------
if(NOT TPM_CONSUMER)
  if(TPM_MPI)
    find_package(MPI 3 REQUIRED COMPONENTS C)
  endif()
  find_package(nlohmann_json 3.11 REQUIRED)
  find_package(Boost 1.74 REQUIRED)  # quadrature and quantiles of Boost.Math
  find_package(utf8cpp 3.2 REQUIRED)
  find_package(nanoflann 1.4 REQUIRED)  # neighbours within a radius
  add_library(tpm_header_only INTERFACE IMPORTED)
  target_link_libraries(tpm_header_only INTERFACE Boost::headers utf8::cpp nanoflann::nanoflann)
  find_package(CLI11 2.1 REQUIRED)
endif()
