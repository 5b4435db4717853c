// Which body hangs from which where joints make a forest: the symbolic part of solver/joint_tree.hpp, by the graph of joints alone.
#pragma once

#include <vector>

namespace cairn {

struct TreePlan {
    struct Node {
        int body = 0;     // relative to the island's first
        int parent = -1;  // node; −1: root
        int joint = -1;   // to the parent, or of a root to what does not move; −1: the root moves freely
        int side = 0;     // of the joint that the body is: 0 for A
    };
    std::vector<Node> nodes;  // of the bodies with joints; parents first
    bool is_forest = false;   // no loops, and each tree hangs from one body that does not move at most
};

// `signature` as JointPlan's: three numbers a joint: kind, bodies A and B relative to the island's first (−1: does not move).
// Roots are the bodies that hang from what does not move, or the middle of the longest way. Allocates.
TreePlan plan_tree(const std::vector<int>& signature);

}  // namespace cairn
