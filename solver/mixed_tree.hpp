// The substep of solver/mixed.hpp where joints make trees: joints and contacts in the coordinates that the joints leave free
// (solver/joint_tree.hpp). Internal.
//
// The first solve's bias is what the drift adds to the linear prediction of C to second order, h/2 C̈: at the velocities that it starts from
// while contacts are swept, then at those that the sweeps leave. Where the two are far apart, SHAKE's iteration follows. What is left then
// is met after the push.
#pragma once

#include "solver/mixed_step.hpp"

namespace cairn {

class TreeStep final : public MixedStepBase {
public:
    using MixedStepBase::MixedStepBase;

    // kNotSo: no forest, joints are far apart, or contact rows would be too long.
    MixedStart begin();

private:
    void renew_joints() override;
    void follow_turn() override;
    Real predict_bias();
    void solve(bool with_friction);
    bool first_solve() override;
    bool push() override;
    bool shake(Real near);
    void second_solve() override;
};

}  // namespace cairn
