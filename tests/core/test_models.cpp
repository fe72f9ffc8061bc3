// SPDX-License-Identifier: MIT
// What the library says its own classes are models of. Here and not in the headers, where every program that includes them would pay for it.
#include <palpate/core/serial.hpp>
#include <palpate/device/any_device.hpp>
#include <palpate/device/force_dimension.hpp>
#include <palpate/device/mouse_device.hpp>
#include <palpate/device/null_device.hpp>
#include <palpate/device/phantom.hpp>
#include <palpate/device/replay_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/device/simulated_hand.hpp>
#include <palpate/device/simulated_touch.hpp>
#include <palpate/extend/device.hpp>
#include <palpate/extend/force.hpp>
#include <palpate/extend/integrator.hpp>
#include <palpate/extend/law.hpp>
#include <palpate/extend/tissue.hpp>
#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/fitting/needle_model.hpp>
#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/exponential_contact.hpp>
#include <palpate/force/hunt_crossley_contact.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/force/karnopp_friction.hpp>
#include <palpate/force/needle_force.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/polynomial_contact.hpp>
#include <palpate/force/speed_curve.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/coupled_force.hpp>
#include <palpate/haptics/filtered_wall.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/haptics/spring_then_tissue.hpp>
#include <palpate/haptics/velocity_estimate.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/integrator/crank_nicolson.hpp>
#include <palpate/integrator/dormand_prince.hpp>
#include <palpate/integrator/explicit_euler.hpp>
#include <palpate/integrator/explicit_midpoint.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/integrator/runge_kutta_4.hpp>
#include <palpate/integrator/stoermer_verlet.hpp>
#include <palpate/integrator/symplectic_euler.hpp>
#include <palpate/integrator/theta_scheme.hpp>
#include <palpate/integrator/velocity_verlet.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/cubic_spring.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/locking_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/saturating_spring.hpp>
#include <palpate/tissue/spring_elements.hpp>
#include <palpate/training/guidance.hpp>

#include "catch.hpp"

namespace palpate {
using namespace detail;
using namespace testing;
namespace {

// core/
static_assert(Execution<Serial>);

// device/
static_assert(HapticDevice<AnyDevice<double>> && HapticDevice<AnyDevice<float>, float> && OpensAndCloses<AnyDevice<double>> &&
              Armable<AnyDevice<double>> && Calibratable<AnyDevice<double>> && AdvisesCalibration<AnyDevice<double>> && ReportsFaults<AnyDevice<double>> &&
              DescribesItself<AnyDevice<double>> && !SelfClocked<AnyDevice<double>>);
static_assert(HapticDevice<ForceDimensionDevice> && OpensAndCloses<ForceDimensionDevice> && Armable<ForceDimensionDevice>);
static_assert(DescribesItself<ForceDimensionDevice> && ReportsFaults<ForceDimensionDevice> && !SelfClocked<ForceDimensionDevice>);
static_assert(Calibratable<ForceDimensionDevice> && AdvisesCalibration<ForceDimensionDevice>);
static_assert(HapticDevice<MouseDevice<double>> && HapticDevice<MouseDevice<float>, float>);
static_assert(HapticDevice<NullDevice<double>> && HapticDevice<NullDevice<float>, float>);
static_assert(HapticDevice<PhantomDevice> && OpensAndCloses<PhantomDevice> && Armable<PhantomDevice> && DescribesItself<PhantomDevice>);
static_assert(Calibratable<PhantomDevice> && ReportsFaults<PhantomDevice> && SelfClocked<PhantomDevice>);
static_assert(HapticDevice<ReplayDevice<double>> && HapticDevice<ReplayDevice<float>, float>);
static_assert(HapticDevice<ScriptedDevice<double>> && HapticDevice<ScriptedDevice<float>, float>);
static_assert(HapticDevice<SimulatedHand<double>> && HapticDevice<SimulatedHand<float>, float>);
static_assert(HapticDevice<SimulatedTouch<double>> && HapticDevice<SimulatedTouch<float>, float> && OpensAndCloses<SimulatedTouch<double>> &&
              Armable<SimulatedTouch<double>> && Calibratable<SimulatedTouch<double>> && AdvisesCalibration<SimulatedTouch<double>> &&
              ReportsFaults<SimulatedTouch<double>> &&
              DescribesItself<SimulatedTouch<double>>);

// extend/
static_assert(HapticDevice<DeviceArchetype<double>> && HapticDevice<DeviceArchetype<float>, float>);
static_assert(ForceModel<ForceArchetype<double>, double> && ForceModel<ForceArchetype<float>, float>);
static_assert(Integrator<IntegratorArchetype> && Integrator<IntegratorArchetype, float>);
static_assert(SpringLaw<LawArchetype<double>, double> && SpringLaw<LawArchetype<float>, float>);
static_assert(Element<ElementArchetype<double>, double> && Element<ElementArchetype<float>, float>);
static_assert(TissueModel<TissueArchetype<double>> && TissueModel<TissueArchetype<float>>);

// fitting/
static_assert(FittedModel<LinearModel> && FittedModel<PolynomialModel> && FittedModel<ExponentialModel> && FittedModel<HuntCrossleyModel>);
static_assert(ForceModel<FittedForce<double>, double> && ForceModel<FittedForce<float>, float>);
static_assert(FittedModel<NeedleModel>);

// force/
static_assert(ForceNoise<BandLimitedNoise<double>, double>);
static_assert(ForceModel<ExponentialContact<double>, double>);
static_assert(ForceModel<HuntCrossleyContact<double>, double>);
static_assert(ForceModel<IndentationSpring<double>, double>);
static_assert(ForceModel<KarnoppFriction<double>, double>);
static_assert(ContactLaw<NeedleForce<double>, double>);
static_assert(ForceNoise<WhiteGaussianNoise<double>, double>);
static_assert(ForceModel<OrganForce<double>, double> && ForceModel<OrganFriction<double>, double>);
static_assert(ForceModel<OrganWalls<double>, double>);
static_assert(ForceModel<PolynomialContact<double>, double>);
static_assert(ForceModel<SpeedCurve<Network<double, 2, 5, 1>>, double> && ForceModel<SpeedCurve<Network<float, 2, 5, 3, 1>>, float>);
static_assert(ForceModel<TissueReaction, double> && ForceModel<TissueReaction, float> && ForceModel<NoForce, double>);

// haptics/
static_assert(SurfaceForce<CoupledForce<ProxyForce<double>>, double> && SurfaceForce<CoupledForce<ProxyForce<float>, BackwardDifference<float>>, float>);
static_assert(LoopFilter<MovingAverage> && LoopFilter<OnePole> && LoopFilter<TickDelay>);
static_assert(SurfaceForce<PressThenCut<ProxyForce<double>>, double> && ContactLaw<PressedReaction<float>, float>);
static_assert(SurfaceForce<ProxyForce<double>, double> && SurfaceForce<ProxyForce<float>, float> && LimitsStiffness<ProxyForce<float>>);
static_assert(ForceModel<SpringThenTissue<double>, double> && ContactLaw<SpringThenTissue<float>, float>);
static_assert(VelocityEstimator<BackwardDifference<double>, double> && VelocityEstimator<WindowedVelocity<double>, double> &&
              VelocityEstimator<AdaptiveWindowVelocity<float>, float>);
static_assert(AdaptsToDevice<BackwardDifference<double>> && AdaptsToDevice<WindowedVelocity<double>> && AdaptsToDevice<AdaptiveWindowVelocity<double>>);

// integrator/
static_assert(StatesStableStep<BackwardEuler> && ImplicitIntegrator<BackwardEuler>);
static_assert(System<SystemArchetype<double>> && !LinearisedSystem<SystemArchetype<double>> && LinearisedSystem<LinearisedSystemArchetype<double>>);
static_assert(StatesStableStep<CrankNicolson> && ImplicitIntegrator<CrankNicolson>);
static_assert(StatesStableStep<DormandPrince>);
static_assert(StatesStableStep<ExplicitEuler>);
static_assert(StatesStableStep<ExplicitMidpoint>);
static_assert(StatesStableStep<LeapfrogVerlet>);
static_assert(StatesStableStep<RungeKutta4>);
static_assert(StatesStableStep<StoermerVerlet>);
static_assert(StatesStableStep<SymplecticEuler>);
static_assert(StatesStableStep<ThetaScheme> && ImplicitIntegrator<ThetaScheme>);
static_assert(StatesStableStep<VelocityVerlet>);
struct OfACopy {   // of the system, which the body never sees
  template <class System>
  void step(System system, typename System::Scalar h) const {
    system.positions() += h * system.velocities();
  }
};
static_assert(!Integrator<OfACopy>);

// region/
static_assert(Region<WholeBody>);
static_assert(Region<ZoneOfInfluence> && AdaptsToError<ZoneOfInfluence>);

// tissue/
static_assert(SpringLaw<CubicSpring<double>, double> && StatesStiffness<CubicSpring<double>, double> &&
              StatesEnergy<CubicSpring<double>, double> && StatesMonotony<CubicSpring<double>, double>);
static_assert(SpringLaw<LinearSpring<double>, double> && StatesStiffness<LinearSpring<double>, double>);
static_assert(SpringLaw<LockingSpring<double>, double> && StatesStiffness<LockingSpring<double>, double> &&
              StatesEnergy<LockingSpring<double>, double> && StatesMonotony<LockingSpring<double>, double>);
static_assert(TissueModel<MassSpring<double>> && CuttableTissue<MassSpring<float>> && RedistributesMass<MassSpring<double>> && DivisibleTissue<MassSpring<float>> &&
              CuttableSolid<MassSpring<double>> && HasTangentOperator<MassSpring<double>>);
static_assert(SpringLaw<SaturatingSpring<double>, double> && StatesStiffness<SaturatingSpring<double>, double>);
static_assert(Element<LinkSpring<double>, double> && HasElementProducts<LinkSpring<double>, double> && HasElementBounds<SupportSpring<float>, float> &&
              HasElementDamping<SupportSpring<float>, float> && HasSemidefiniteStiffness<LinkSpring<float>, float> &&
              HasElementProducts<AnchorSpring<double>, double> && HasElementBounds<AnchorSpring<float>, float>);

// training/
static_assert(ForceOverlay<PathGuidance<double>, double> && ForceOverlay<PathGuidance<float>, float>);

}  // namespace
}  // namespace palpate

TEST_CASE("the library's own classes are models of its concepts") { SUCCEED("said by the compiler"); }
