// A bounded convex shape against a static one-sided triangle mesh.
#include "collision/narrow_pair.hpp"

namespace cairn::narrow {

NarrowResult collide_with_mesh(Query& q) {
    return failed(q);
}

}  // namespace cairn::narrow
