// The wide kernels for every processor: what the others are tested against where there is none.
#define CAIRN_WIDE_SET portable
#include "solver/wide_load.hpp"

namespace cairn {

const WideKernel kPortableWideKernel = {
    "portable",     portable::build, portable::start_first, portable::sweep_normals, portable::sweep_velocities,
    portable::hold, portable::push,  portable::advance,     portable::start_second,  portable::close,
    portable::store};

}  // namespace cairn
