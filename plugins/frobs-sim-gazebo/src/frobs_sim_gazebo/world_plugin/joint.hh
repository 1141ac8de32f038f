// One joint with its drive, at the physics rate.
#pragma once

#include <gazebo/physics/physics.hh>
#include <gazebo/physics/ode/ode_inc.h>

namespace frobs
{
/// A revolute or prismatic joint of ODE.
///
/// The drive law is effort = clip(command - kp q - kd v, +-limit). Its spring is a force; its damping is a row of ODE's own
/// equations, J v + cfm e = 0 with cfm = 1 / damping, so that it is implicit in the velocity at the step's end, contacts
/// included. ODE provides that row as a joint stop with equal limits.
class Joint
{
  public: Joint(const gazebo::physics::ModelPtr &_model, const std::string &_name, const std::string &_child);

  /// Read position and velocity; positions do not wrap.
  public: void Read();

  /// Set the position after a teleport: ODE reports angles only up to whole turns.
  public: void PutAt(double _position);

  /// Set the command of the joint for the next step.
  public: void Drive();

  /// Force the joint to a position in the next step.
  public: void Follow(double _target);

  public: double lower = 0, upper = 0;
  public: int leader = -1;
  public: double multiplier = 1, offset = 0;
  public: double kp = 0, kd = 0, damping = 0, friction = 0, limit = 0;
  public: double command = 0;
  public: double position = 0, velocity = 0, effort = 0;

  private: double Raw() const;
  private: void Stop(double _low, double _high, double _erp, double _cfm);
  private: void Set(int _parameter, double _value);

  private: dJointID id = nullptr;
  private: bool turns = true;
  private: double raw = 0;
};
}
