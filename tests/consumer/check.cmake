# Run by ctest: installs the build into a folder of its own, moves that folder (an installation must
# not depend on where it was made), builds the consumer against it and runs it.
#   -D BUILD=...   the build folder of tpmkit     -D SOURCE=... this folder
#   -D WORK=...    a folder to use up             -D CXX=... the compiler
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " line)
    message(FATAL_ERROR "'${line}' ended with ${status}:\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
file(RENAME ${WORK}/first ${WORK}/moved)
run(${CMAKE_COMMAND} -G Ninja -S ${SOURCE} -B ${WORK}/build -D CMAKE_PREFIX_PATH=${WORK}/moved
    -D CMAKE_CXX_COMPILER=${CXX} -D CMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
run(${WORK}/moved/bin/tpm version)
file(GLOB_RECURSE exported ${WORK}/moved/lib/*.cmake)
foreach(file IN LISTS exported)
  file(STRINGS ${file} absolute REGEX "[\";=]/[A-Za-z]")
  if(absolute)
    message(FATAL_ERROR "${file} holds paths of this machine: ${absolute}")
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK})
