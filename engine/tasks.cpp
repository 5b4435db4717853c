#include "engine/tasks.hpp"

#include "engine/base/error.hpp"

#include <algorithm>

#ifdef CAIRN_WITH_TBB
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace cairn {
namespace {

#ifdef CAIRN_WITH_TBB
class TbbTasks : public TaskSystem {
public:
    // oneTBB has no more threads than the machine has cores.
    explicit TbbTasks(int threads) : arena_(std::min(threads, tbb::info::default_concurrency())) {}
    int workers() const override { return arena_.max_concurrency(); }
    void run(int count, Task task, void* context) override {
        arena_.execute(
            [&] { tbb::parallel_for(0, count, [&](int index) { task(context, index, tbb::this_task_arena::current_thread_index()); }); });
    }

private:
    tbb::task_arena arena_;
};
#endif

}  // namespace

std::shared_ptr<TaskSystem> make_task_system(int threads) {
    if (threads < 1) throw_invalid("threads", threads, ">= 1");
#ifdef CAIRN_WITH_TBB
    if (threads > 1) return std::make_shared<TbbTasks>(threads);
#endif
    return nullptr;
}

}  // namespace cairn
