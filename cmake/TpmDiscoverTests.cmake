# Run after a test program was linked: writes a file for ctest with a test for each case of Catch2 in it. Catch2's own
# discovery gives a test one label at most.
#   -D PROGRAM=...  -D PREFIX=...  -D SPEC=...  -D LABELS=a,b  -D ENVIRONMENT=...  -D FOLDER=...  -D FILE=...  [-D LANES=N]
# LANES: the cases wait for the clock; at most N run at once, and they begin before others (tests/CMakeLists.txt). Those
# tagged [untimed] take no turns.
function(list_cases list count filter)
  execute_process(COMMAND ${PROGRAM} ${filter} --list-test-names-only OUTPUT_VARIABLE output RESULT_VARIABLE listed
                  WORKING_DIRECTORY ${FOLDER})
  if(NOT listed MATCHES "^[0-9]+$")  # Catch2 returns how many there are
    message(FATAL_ERROR "${PROGRAM} does not list its test cases: ${listed}\n${output}")
  endif()
  string(REPLACE ";" "\\;" output "${output}")
  string(REGEX REPLACE "\n$" "" output "${output}")
  string(REPLACE "[" "<open>" output "${output}")  # brackets keep a list together
  string(REPLACE "]" "<shut>" output "${output}")
  string(REPLACE "\n" ";" output "${output}")
  set(${list} "${output}" PARENT_SCOPE)
  set(${count} ${listed} PARENT_SCOPE)
endfunction()
list_cases(cases count "${SPEC}")
if(NOT count)
  message(FATAL_ERROR "${PROGRAM} lists no test case")
endif()
set(untimed "")
if(LANES)
  list_cases(untimed count "${SPEC}[untimed]")
endif()
string(REPLACE "," ";" LABELS "${LABELS}")
set(script "")
set(lane 0)
foreach(case IN LISTS cases)
  list(FIND untimed "${case}" place)
  string(REPLACE "<open>" "[" case "${case}")
  string(REPLACE "<shut>" "]" case "${case}")
  set(filter "${case}")
  foreach(special "\\" "," "[" "]")
    string(REPLACE "${special}" "\\${special}" filter "${filter}")
  endforeach()
  string(APPEND script "add_test([==[${PREFIX}: ${case}]==] [==[${PROGRAM}]==] [==[${filter}]==])\n"
    "set_tests_properties([==[${PREFIX}: ${case}]==] PROPERTIES WORKING_DIRECTORY [==[${FOLDER}]==] "
    "LABELS [==[${LABELS}]==] ENVIRONMENT [==[${ENVIRONMENT}]==])\n")
  if(LANES AND place EQUAL -1)
    math(EXPR lane "(${lane} + 1) % ${LANES}")
    string(APPEND script "set_tests_properties([==[${PREFIX}: ${case}]==] PROPERTIES RESOURCE_LOCK clock_${lane} COST 100)\n")
  endif()
endforeach()
file(WRITE "${FILE}" "${script}")
