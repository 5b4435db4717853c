// Work side by side. A world asks a TaskSystem to run tasks that do not depend on each other; a game with workers of its own implements one
// and gives it to WorldSettings::tasks. Results do not depend on how many workers there are, nor on which one runs a task.
#pragma once

#include <memory>
#include <type_traits>

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
};

// So many threads of oneTBB (the caller among them, and no more than the machine has); null if Cairn was built without it, or for one
// thread. Throws Error for threads < 1.
std::shared_ptr<TaskSystem> make_task_system(int threads);

// f(index, worker) for every index in [0, count): by the task system if there is one, else here, in ascending order, as worker 0.
template <class F>
void run_tasks(TaskSystem* tasks, int count, F&& f) {
    if (tasks == nullptr || count < 2) {
        for (int i = 0; i < count; ++i) f(i, 0);
        return;
    }
    tasks->run(
        count, [](void* context, int index, int worker) { (*static_cast<std::remove_reference_t<F>*>(context))(index, worker); }, &f);
}

}  // namespace cairn
