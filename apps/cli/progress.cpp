#include "apps/cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace cairn::cli {

Progress::Progress(bool wanted) : active_(wanted && ::isatty(STDERR_FILENO) == 1), start_(Clock::now()), last_(start_) {}

Progress::~Progress() {
    if (drawn_) fmt::print(stderr, "\r\x1b[K");
}

void Progress::update(long done, long all) {
    if (!active_) return;
    const Clock::time_point now = Clock::now();
    if (now - start_ < std::chrono::seconds(1) || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    constexpr int kWidth = 40;
    const double share = static_cast<double>(done) / static_cast<double>(all);
    const std::string bar(static_cast<std::size_t>(share * kWidth), '#');
    const double left = std::chrono::duration<double>(now - start_).count() * (1 - share) / share;
    fmt::print(stderr, "\r[{:<{}}] {:3.0f} %  {:.0f} s left\x1b[K", bar, kWidth, 100 * share, left);
    std::fflush(stderr);
}

}  // namespace cairn::cli
