// Calls that may take seconds: they run without the interpreter's lock on a thread of their own, and Ctrl-C ends them.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>

namespace trocar::python {

/// Thrown by a StopCheck, where the caller has been interrupted: unwinds the work.
struct Interrupted {};

/// To be called by the work now and then.
using StopCheck = std::function<void()>;

/// Calls work(check), from a thread that holds the interpreter's lock, and returns when it is done; what it throws is thrown here.
/// After a signal whose handler raises (Ctrl-C) that exception is thrown at once, and the work is left to end at its next check, by
/// itself: it must own all that it reads and writes.
void run_long(std::function<void(const StopCheck&)> work);

/// Waits until all work that was left has ended. For the interpreter's end.
void join_left_work();

/// With the interpreter's lock given back.
template <class Work>
auto free(const Work& work) {
    const pybind11::gil_scoped_release released;
    return work();
}

} // namespace trocar::python
