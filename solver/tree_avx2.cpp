// The kernels of solver/tree_contacts.hpp for processors with AVX2 (compiled with -mavx2; tree_contacts.cpp asks the processor first).
#if defined(__x86_64__)
#define CAIRN_WIDE_SET avx2
#include "solver/tree_sweep.hpp"

namespace cairn {

const TreeKernel kAvx2TreeKernel = {"avx2", avx2::build_tree_point, avx2::sweep_tree};

}  // namespace cairn
#endif
