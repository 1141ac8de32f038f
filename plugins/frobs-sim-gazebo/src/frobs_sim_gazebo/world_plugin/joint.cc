#include "joint.hh"

#include <gazebo/physics/ode/ODELink.hh>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace frobs
{
namespace
{
/// [rad/s or m/s] below which dry friction is a damper: a joint at rest creeps under load, but does not chatter.
const double STICKING = 1e-3;

/// Fraction of a limit violation that one step corrects.
const double LIMIT_ERP = 0.2;
}

Joint::Joint(const gazebo::physics::ModelPtr &_model, const std::string &_name, const std::string &_child)
{
  auto link = boost::dynamic_pointer_cast<gazebo::physics::ODELink>(_model->GetLink(_child));
  auto joint = _model->GetJoint(_name);
  if (!link || !joint)
    throw std::runtime_error("model '" + _model->GetName() + "' has no joint '" + _name + "' or no link '" + _child + "'");
  auto parent = boost::dynamic_pointer_cast<gazebo::physics::ODELink>(joint->GetParent());
  const dBodyID below = link->GetODEId(), above = parent ? parent->GetODEId() : nullptr;
  for (int i = 0; i < dBodyGetNumJoints(below); ++i)
  {
    const dJointID found = dBodyGetJoint(below, i);
    const dBodyID first = dJointGetBody(found, 0), second = dJointGetBody(found, 1);
    const bool between = (first == below && second == above) || (first == above && second == below);
    const dJointType type = dJointGetType(found);
    if (between && (type == dJointTypeHinge || type == dJointTypeSlider))
    {
      this->id = found;
      this->turns = type == dJointTypeHinge;
    }
  }
  if (!this->id)
    throw std::runtime_error("joint '" + _name + "' is neither revolute nor prismatic");
  this->raw = this->Raw();
  this->position = this->raw;
}

double Joint::Raw() const
{
  return this->turns ? dJointGetHingeAngle(this->id) : dJointGetSliderPosition(this->id);
}

void Joint::Read()
{
  const double now = this->Raw();
  if (this->turns)
    this->position += std::remainder(now - this->raw, 2 * M_PI);
  else
    this->position = now;
  this->raw = now;
  this->velocity = this->turns ? dJointGetHingeAngleRate(this->id) : dJointGetSliderPositionRate(this->id);
}

void Joint::PutAt(double _position)
{
  this->raw = this->Raw();
  this->position = _position;
}

void Joint::Drive()
{
  this->Read();
  const double spring = this->command - this->kp * this->position;
  const double wanted = spring - this->kd * this->velocity;
  this->effort = std::min(this->limit, std::max(-this->limit, wanted));
  const bool saturated = std::abs(wanted) >= this->limit;
  double damper = this->damping + (saturated ? 0 : this->kd);
  if (this->friction > 0)
    damper += this->friction / std::max(std::abs(this->velocity), STICKING);
  double force = saturated ? this->effort : spring;
  if (this->position <= this->lower || this->position >= this->upper)
  {
    // ODE has one row for either a stop or a damper; at a stop, a joint hardly moves.
    force = std::min(this->limit, std::max(-this->limit, force));
    const double low = this->position <= this->lower ? this->raw + this->lower - this->position : -dInfinity;
    const double high = this->position >= this->upper ? this->raw + this->upper - this->position : dInfinity;
    this->Stop(low, high, LIMIT_ERP, 0);
  }
  else if (damper > 0)
    this->Stop(this->raw, this->raw, 0, 1 / damper);
  else
    this->Stop(-dInfinity, dInfinity, 0, 0);
  if (this->turns)
    dJointAddHingeTorque(this->id, force);
  else
    dJointAddSliderForce(this->id, force);
}

void Joint::Follow(double _target)
{
  this->Read();
  const double stop = this->raw + _target - this->position;
  this->Stop(stop, stop, 1, 0);
}

void Joint::Stop(double _low, double _high, double _erp, double _cfm)
{
  this->Set(dParamLoStop, -dInfinity);
  this->Set(dParamHiStop, _high);
  this->Set(dParamLoStop, _low);
  this->Set(dParamStopERP, _erp);
  this->Set(dParamStopCFM, _cfm);
}

void Joint::Set(int _parameter, double _value)
{
  if (this->turns)
    dJointSetHingeParam(this->id, _parameter, _value);
  else
    dJointSetSliderParam(this->id, _parameter, _value);
}
}
