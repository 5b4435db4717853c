// Where a result comes from: without it a time means nothing.
#pragma once

#include <string>

namespace cairn::cli {

struct Machine {
    std::string cpu;     // model name
    int cores = 0;       // that the system shows
    std::string system;  // kernel and architecture
    std::string compiler;
    std::string flags;
    std::string commit;  // of the source tree, "+" behind it with changes on top; "unknown" without one
    std::string date;    // UTC, ISO 8601
};

Machine this_machine();

}  // namespace cairn::cli
