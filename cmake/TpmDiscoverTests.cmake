# Run after a test program was linked: writes a file for ctest with a test for each case of Catch2 in it. Catch2's own
# discovery gives a test one label at most.
#   -D PROGRAM=...  -D PREFIX=...  -D SPEC=...  -D LABELS=a,b  -D ENVIRONMENT=...  -D FOLDER=...  -D FILE=...  [-D LANES=N]
# LANES: the cases wait for the clock; at most N run at once, and they begin before others (tests/CMakeLists.txt).
execute_process(COMMAND ${PROGRAM} ${SPEC} --list-test-names-only OUTPUT_VARIABLE output RESULT_VARIABLE count
                WORKING_DIRECTORY ${FOLDER})
if(NOT count MATCHES "^[1-9][0-9]*$")  # Catch2 returns how many there are
  message(FATAL_ERROR "${PROGRAM} lists no test case: ${count}\n${output}")
endif()
string(REPLACE "," ";" LABELS "${LABELS}")
set(script "")
set(lane 0)
string(REPLACE ";" "\\;" output "${output}")
string(REGEX REPLACE "\n$" "" output "${output}")
string(REPLACE "[" "<open>" output "${output}")  # brackets keep a list together
string(REPLACE "]" "<shut>" output "${output}")
string(REPLACE "\n" ";" cases "${output}")
foreach(case IN LISTS cases)
  string(REPLACE "<open>" "[" case "${case}")
  string(REPLACE "<shut>" "]" case "${case}")
  set(filter "${case}")
  foreach(special "\\" "," "[" "]")
    string(REPLACE "${special}" "\\${special}" filter "${filter}")
  endforeach()
  string(APPEND script "add_test([==[${PREFIX}: ${case}]==] [==[${PROGRAM}]==] [==[${filter}]==])\n"
    "set_tests_properties([==[${PREFIX}: ${case}]==] PROPERTIES WORKING_DIRECTORY [==[${FOLDER}]==] "
    "LABELS [==[${LABELS}]==] ENVIRONMENT [==[${ENVIRONMENT}]==])\n")
  if(LANES)
    math(EXPR lane "(${lane} + 1) % ${LANES}")
    string(APPEND script "set_tests_properties([==[${PREFIX}: ${case}]==] PROPERTIES RESOURCE_LOCK clock_${lane} COST 100)\n")
  endif()
endforeach()
file(WRITE "${FILE}" "${script}")
