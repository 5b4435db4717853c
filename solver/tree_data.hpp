// Contact rows in the coordinates of a tree (solver/tree_contacts.hpp): the layout that their kernels work on. Plain doubles: nothing here
// depends on the instruction set that a file is compiled for.
#pragma once

namespace cairn {

constexpr int kTreePad = 4;  // doubles of a row come in so many
constexpr int kTreeRowsAPoint = 3;

// A node on the way of a block's bodies to their roots.
struct TreePart {
    const double* S = nullptr;  // S̃ and Ũ of solver/joint_tree.hpp: six rows, columns one after another
    const double* U = nullptr;
    int dofs = 0;
    int at = 0;    // of its numbers in a row
    int side = 0;  // whose impulse goes this way, of both from where they meet
    bool meets = false;
    bool is_top = false;  // nothing follows on this side
};

struct TreeBlock {
    const double* arm_a = nullptr;  // from O to the bodies' centres; null: does not move, or moves as it will
    const double* arm_b = nullptr;
    double mu = 0;
    int part_begin = 0, part_end = 0;
    int pair = 0;    // first of the places of its numbers in z, which come in pairs
    int quads = 0;   // length of a row in fours
    int values = 0;  // first double of its rows
    int row = 0;     // first of its rows
    int point = 0;   // first of its points in the pool
    int count = 0;
    bool has_friction = false;
    bool is_padded = false;  // its last pair stands for nothing
};

struct TreeRow {
    double mass = 0;
    double inv_mass = 0;
    double aim = 0;  // of ỹᵀ z
};

// What a point's rows are built from: normal and two tangents; those of a point without friction are any.
struct TreePoint {
    const double* direction[3];
    const double* ang_a[3];
    const double* ang_b[3];
    double softness[3];  // added to ‖ỹ‖²
};

struct TreeSweep {
    const TreeBlock* blocks;
    int block_count;
    const int* pairs;
    const double* values;
    const TreeRow* rows;
    double* impulses;  // three a point of the pool
    double* z;
    double* scratch;  // as long as the longest row
};

struct TreeKernel {
    const char* name;
    // ỹ and masses of a point; `values` and `rows`: where they go.
    void (*build)(const TreeBlock& block, const TreePart* parts, const TreePoint& point, double* values, TreeRow* rows);
    double (*sweep)(const TreeSweep& sweep, bool with_friction);
};

extern const TreeKernel kPortableTreeKernel;
#if defined(__x86_64__)
extern const TreeKernel kAvx2TreeKernel;
#endif

}  // namespace cairn
