// viscera_bullet: steps a deformable body of Bullet with a held base and a patch moved down, for
// the benchmark: viscera_bullet INPUT OUTPUT.
//
// Input: young poisson depth steps linear (0 or 1), N, N lines "x y z", E, E lines of four nodes,
// H, held nodes, P, patch nodes. Output: "step_s rest_s setup_s" (the median step, all of them,
// what came before), then N lines of displacement.
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <vector>

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<int> read_nodes() {
  std::size_t count = 0;
  std::cin >> count;
  std::vector<int> nodes(count);
  for (int& node : nodes) std::cin >> node;
  return nodes;
}

/// The linear theory: no tetrahedron's strain is turned with it.
class UnturnedElasticity final : public btDeformableLinearElasticityForce {
  using Base = btDeformableLinearElasticityForce;

 public:
  using Base::Base;
  void addScaledElasticForce(btScalar scale, TVStack& force) override {
    unturn();
    Base::addScaledElasticForce(scale, force);
  }
  void addScaledElasticForceDifferential(btScalar scale, const TVStack& dx, TVStack& df) override {
    unturn();
    Base::addScaledElasticForceDifferential(scale, dx, df);
  }
  void addScaledDampingForce(btScalar scale, TVStack& force) override {
    unturn();
    Base::addScaledDampingForce(scale, force);
  }
  void addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) override {
    unturn();
    Base::addScaledDampingForceDifferential(scale, dv, df);
  }

 private:
  void unturn() {
    for (int i = 0; i < m_softBodies.size(); ++i)
      for (int j = 0; j < m_softBodies[i]->m_tetraScratches.size(); ++j)
        m_softBodies[i]->m_tetraScratches[j].m_corotation.setIdentity();
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 || !std::freopen(argv[1], "r", stdin) || !std::freopen(argv[2], "w", stdout)) {
    std::fputs("viscera_bullet: expected an input file and an output file\n", stderr);
    return 2;
  }
  double young = 0.0, poisson = 0.0, depth = 0.0;
  int steps = 0, linear = 0;
  std::size_t count = 0;
  std::cin >> young >> poisson >> depth >> steps >> linear >> count;
  std::vector<btVector3> places(count);
  for (btVector3& x : places) {
    double a = 0.0, b = 0.0, c = 0.0;
    std::cin >> a >> b >> c;
    x = btVector3(btScalar(a), btScalar(b), btScalar(c));
  }
  std::size_t elements = 0;
  std::cin >> elements;
  std::vector<int> corners(4 * elements);
  for (int& corner : corners) std::cin >> corner;
  const std::vector<int> held = read_nodes(), patch = read_nodes();
  if (!std::cin || count == 0) {
    std::fputs("viscera_bullet: found no whole mesh\n", stderr);
    return 2;
  }

  const auto start = std::chrono::steady_clock::now();
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btDeformableBodySolver body_solver;
  btDeformableMultiBodyConstraintSolver constraint_solver;
  constraint_solver.setDeformableSolver(&body_solver);
  btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraint_solver,
                                           &configuration, &body_solver);
  world.setGravity(btVector3(0, 0, 0));
  world.getWorldInfo().m_gravity.setValue(0, 0, 0);
  world.setImplicit(true);
  world.setLineSearch(false);
  world.setUseProjection(true);

  const std::vector<btScalar> masses(count, btScalar(1));
  btSoftBody body(&world.getWorldInfo(), static_cast<int>(count), places.data(), masses.data());
  for (std::size_t e = 0; e < elements; ++e)
    body.appendTetra(corners[4 * e], corners[4 * e + 1], corners[4 * e + 2], corners[4 * e + 3]);
  body.setTotalMass(btScalar(0.03));  // 1,000 kg/m3 in a hemisphere of 25 mm
  for (const int node : held) body.setMass(node, 0);
  for (const int node : patch) body.setMass(node, 0);
  body.initializeDmInverse();
  body.m_tetraScratches.resize(body.m_tetras.size());
  body.m_tetraScratchesTn.resize(body.m_tetras.size());
  body.m_cfg.kDP = 0;
  body.m_cfg.collisions = 0;
  body.setSelfCollision(false);
  body.m_sleepingThreshold = 0;
  world.addSoftBody(&body);
  const double mu = young / (2.0 * (1.0 + poisson));
  const double lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
  btDeformableLinearElasticityForce* elasticity =
      linear
          ? new UnturnedElasticity(btScalar(mu), btScalar(lambda), btScalar(0.02))
          : new btDeformableLinearElasticityForce(btScalar(mu), btScalar(lambda), btScalar(0.02));
  world.addForce(&body, elasticity);
  const double setup = seconds_since(start);

  // The patch goes down over the first quarter of the steps, then the body comes to rest.
  std::vector<double> times;
  for (int step = 1; step <= steps; ++step) {
    const double share = std::min(1.0, 4.0 * step / steps);
    for (const int node : patch) {
      btSoftBody::Node& n = body.m_nodes[node];
      n.m_x = n.m_q =
          places[static_cast<std::size_t>(node)] - btVector3(0, 0, btScalar(share * depth));
      n.m_v.setZero();
    }
    const auto begin = std::chrono::steady_clock::now();
    world.stepSimulation(btScalar(1.0 / 60.0), 1, btScalar(1.0 / 60.0));
    times.push_back(seconds_since(begin));
  }
  double rest = 0.0;
  for (const double time : times) rest += time;
  std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
  std::printf("%.9g %.9g %.9g\n", times[static_cast<std::size_t>(steps / 2)], rest, setup);
  for (std::size_t i = 0; i < count; ++i) {
    const btVector3 u = body.m_nodes[static_cast<int>(i)].m_x - places[i];
    std::printf("%.9g %.9g %.9g\n", double(u.x()), double(u.y()), double(u.z()));
  }
  std::fflush(stdout);
  // Bullet's objects refer to each other; the process ends here anyway.
  std::_Exit(0);
}
