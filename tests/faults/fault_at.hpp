#pragma once
#include <dlfcn.h>

/// fault_at.cpp lists the calls that fail. Not seen by the program: its names stay its own.
#pragma GCC visibility push(hidden)
namespace fault_at {

/// @returns true, with errno set, if this request for memory is to fail
bool memory_fails();
/// @returns true if this thread is not to begin
bool thread_fails();
/// Number of the error with which this process is not to begin; 0 if it is.
int process_error(const char* name, const char* program);

/// The call of the C library that is taken over.
template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace fault_at
#pragma GCC visibility pop
