// stress.json: the limits that were found, with the machine.
#pragma once

#include "apps/cli/bench/machine.hpp"
#include "apps/cli/stress/search.hpp"

namespace cairn::cli {

struct StressRow {
    LimitResult result;
    std::string what, unit, criterion;  // of the limit
};

void write_stress(const std::string& folder, const Machine& machine, const std::vector<StressRow>& rows);
// Empty if the folder has none.
std::vector<StressRow> read_stress(const std::string& folder);

}  // namespace cairn::cli
