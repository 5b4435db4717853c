// What the substeps of solver/mixed.hpp share, however the joints are solved for. Internal.
#pragma once

#include "solver/island_probe.hpp"
#include "solver/mixed.hpp"
#include "solver/mixed_response.hpp"
#include "solver/tree_contacts.hpp"

namespace cairn {

struct MixedWorkspace::Data {
    struct Start {
        Vec3 x;
        Quat q;
        Vec3 w_end;  // after the drift
    };
    // What a step changes of an island before it is known to succeed.
    struct Saved {
        std::vector<BodyMotion> motion;
        std::vector<BodyVelocity> velocity;
        std::vector<WarmImpulse> warm;
        void save(const SolverBodies& bodies, const ContactPool& contacts, const SiIsland& island);
        void restore(SolverBodies& bodies, ContactPool& contacts, const SiIsland& island) const;
    };
    JointPlans plans;
    JointRowList rows;
    BlockLdlt ldlt;
    ContactResponse response;
    JointTree tree;
    TreeContacts tree_contacts;
    Saved saved;
    std::vector<Start> start;                                                     // by body of the island
    std::vector<Real> warm_first, warm_second, first, second, total;              // impulses, size rows
    std::vector<Real> gap, start_gap, target, bias, residual, pushed, stiffness;  // size rows
};

// Rows and factor serve on while bodies have moved by less than this, relative to the largest arm.
constexpr Real kKeepFactor = 1e-7;
// Most parts that tension cuts a substep into.
constexpr int kMostMixedParts = 64;

enum class MixedStart : std::uint8_t { kReady, kTooCostly, kNotSo };

class MixedStepBase {
public:
    MixedStepBase(MixedWorkspace::Data& workspace, SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island,
                  Real h, const MixedSettings& settings, MixedReport& report, IslandProbe* probe)
        : ws_(workspace),
          bodies_(bodies),
          contacts_(contacts),
          joints_(joints),
          island_(island),
          settings_(settings),
          report_(report),
          probe_(probe),
          h_(h) {}

    // Into how many parts the substep is to be cut for what tension makes of it: a power of two.
    int parts_for_tension();
    void cut(int parts);
    bool substep();  // false: SHAKE does not contract
    void store(Real warm_scale);

protected:
    // The parts of a substep that the joints' solution makes.
    virtual void renew_joints() = 0;
    virtual void follow_turn() = 0;  // contact rows at the present poses, where they have changed enough
    virtual bool first_solve() = 0;
    virtual bool push() = 0;
    virtual void second_solve() = 0;

    ~MixedStepBase() = default;
    int first() const { return island_.body_begin; }
    MixedStart begin_rows();
    void errors() { ws_.rows.errors(joints_, island_.joints, bodies_, ws_.residual.data()); }
    Real largest_gap() const;
    void set_target();
    void remember_start();
    void trial();
    Real misses();
    bool is_lost(int k, Real largest, Real last) const { return k == settings_.max_corrections || !(largest < 2 * last); }
    bool is_slack(Real largest) const;
    void finish_drift();
    void note_second();
    void end_substep();

    MixedWorkspace::Data& ws_;
    SolverBodies& bodies_;
    ContactPool& contacts_;
    JointPool& joints_;
    const SiIsland& island_;
    const MixedSettings& settings_;
    MixedReport& report_;
    IslandProbe* probe_;
    const JointPlan* plan_ = nullptr;
    Real h_;
    int rows_ = 0;
    Real size_ = 1;                          // [m], largest arm
    Real moved_ = 0;                         // [m], by the bodies since the rows were built, summed, at most
    Real turned_ = 0, response_turned_ = 0;  // [rad], at most, since the contact rows, W were built
};

}  // namespace cairn
