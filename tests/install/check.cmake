# cmake -D mode=package|subdirectory -D source=DIR -D build=DIR -D version=X -D compiler=PATH -D launcher=PATH -D generator=NAME -P check.cmake
# Builds tests/install/MODE with the first C++ block of README.md as hello.cpp, runs it and reads what it printed.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE errors)
  string(APPEND output "${errors}")
  if(NOT code EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${code}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(folder ${build}/install-test/${mode})
file(REMOVE_RECURSE ${folder})

# The example, from the line after ```cpp to the line before ```.
file(READ ${source}/README.md readme)
string(FIND "${readme}" "\n```cpp\n" begin)
if(begin EQUAL -1)
  message(FATAL_ERROR "README.md holds no ```cpp block")
endif()
math(EXPR begin "${begin} + 8")
string(SUBSTRING "${readme}" ${begin} -1 readme)
string(FIND "${readme}" "\n```" end)
string(SUBSTRING "${readme}" 0 ${end} example)
file(WRITE ${folder}/hello.cpp "${example}\n")

set(options -D CMAKE_CXX_COMPILER=${compiler} -D CMAKE_CXX_COMPILER_LAUNCHER=${launcher} -D example=${folder}/hello.cpp)
if(mode STREQUAL "package")
  run(${CMAKE_COMMAND} --install ${build} --prefix ${folder}/prefix)
  list(APPEND options -D CMAKE_PREFIX_PATH=${folder}/prefix -D expected_version=${version})
  foreach(file IN ITEMS bin/cairn share/cairn/scenes include/cairn/engine/world.hpp include/cairn/engine/base/math.hpp)
    if(NOT EXISTS ${folder}/prefix/${file})
      message(FATAL_ERROR "${file} has not been installed")
    endif()
  endforeach()
  # The headers alone say what a consumer sees: no FCL, no libccd.
  run(${CMAKE_COMMAND} -E env ${folder}/prefix/bin/cairn --help)
else()
  list(APPEND options -D cairn_source=${source})
endif()

run(${CMAKE_COMMAND} -G ${generator} -S ${source}/tests/install/${mode} -B ${folder}/build ${options})
run(${CMAKE_COMMAND} --build ${folder}/build)
run(${folder}/build/hello)

# Ten heights, one a line; a 1 m box that fell from 2 m rests with its centre at 0.5 m, to within what a contact may sink in (1 cm).
string(REGEX MATCHALL "[^\n]+" lines "${output}")
list(LENGTH lines count)
list(GET lines -1 last)
if(count LESS 10 OR NOT last MATCHES "0\\.(49|50)[0-9]*")
  message(FATAL_ERROR "The example's last height should be 0.5 m; it printed:\n${output}")
endif()
message(STATUS "The example printed:\n${output}")
