// Workers for a step. Internal.
#pragma once

#include "engine/base/team.hpp"
#include "engine/tasks.hpp"

namespace cairn {

// Calls lead(team) on one of the workers of the task system, with the others at its hand; returns when that has returned.
template <class F>
void with_team(TaskSystem& tasks, F&& lead) {
    Team team(tasks.workers());
    auto take_part = [&] {
        if (!team.take_lead()) return team.help();
        lead(team);
        team.finish();
    };
    tasks.run(
        team.size(), [](void* context, int, int) { (*static_cast<decltype(take_part)*>(context))(); }, &take_part);
}

}  // namespace cairn
