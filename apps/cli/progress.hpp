// A progress bar on standard error: only on a terminal, and only for a run that takes longer than a second.
#pragma once

#include <chrono>
#include <string>

namespace cairn::cli {

class Progress {
public:
    explicit Progress(bool wanted);
    ~Progress();  // takes the bar away
    void update(long done, long all);

private:
    using Clock = std::chrono::steady_clock;
    bool active_;
    bool drawn_ = false;
    Clock::time_point start_;
    Clock::time_point last_;
};

}  // namespace cairn::cli
