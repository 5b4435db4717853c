// Work side by side. A world asks a TaskSystem for workers, once a step where the step is long enough: each of them is a task that helps
// until the step is done (engine/base/team.hpp). A game with workers of its own implements one and gives it to WorldSettings::tasks.
// Results do not depend on how many workers there are, nor on which of them come, or when.
#pragma once

#include <memory>

namespace cairn {

class TaskSystem {
public:
    using Task = void (*)(void* context, int index, int worker);

    virtual ~TaskSystem() = default;
    // Most calls that run() makes at the same time, >= 1; always the same number.
    virtual int workers() const = 0;
    // Calls task(context, index, worker) once for every index in [0, count), in any order, and returns when all have returned, with what
    // they wrote visible to the caller. worker: in [0, workers()), and never that of another call that has not returned. Tasks do not
    // throw, and do not call run().
    virtual void run(int count, Task task, void* context) = 0;
    // [s], about what it takes until others work, too: a step that is not a few times longer stays with the caller. Has no say in any
    // result.
    virtual double start_time() const { return 3e-5; }
};

// So many threads of oneTBB (the caller among them, and no more than the machine has); null if Cairn was built without it, or for one
// thread. Throws Error for threads < 1.
std::shared_ptr<TaskSystem> make_task_system(int threads);

}  // namespace cairn
