// The one function that an adapter's module exports, as `extern "C"`, under this name.
#pragma once

#include "apps/cli/rivals/rival.hpp"

namespace cairn::cli {

// Builds the engine's world from the scene, which must outlive it. The caller owns what it gets. Throws Error, or Unsupported.
using MakeRival = Rival*(const Scene& scene, const RivalOptions& options);
constexpr const char* kMakeRival = "cairn_make_rival";

}  // namespace cairn::cli
