// The wide kernels for processors with AVX2 (compiled with -mavx2; wide_contacts.cpp asks the processor before it calls them).
#if defined(__x86_64__)
#define CAIRN_WIDE_SET avx2
#include "solver/wide_load.hpp"

namespace cairn {

const WideKernel kAvx2WideKernel = {"avx2",     avx2::build, avx2::start_first, avx2::sweep_normals, avx2::sweep_velocities,
                                    avx2::hold, avx2::push,  avx2::advance,     avx2::start_second,  avx2::close,
                                    avx2::store};

}  // namespace cairn
#endif
