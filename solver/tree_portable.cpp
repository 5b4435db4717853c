// The kernels of solver/tree_contacts.hpp for every processor.
#define CAIRN_WIDE_SET portable
#include "solver/tree_sweep.hpp"

namespace cairn {

const TreeKernel kPortableTreeKernel = {"portable", portable::build_tree_point, portable::sweep_tree};

}  // namespace cairn
