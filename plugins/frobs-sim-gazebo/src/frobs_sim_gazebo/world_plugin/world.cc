#include "world.hh"

#include <gazebo/physics/ContactManager.hh>

#include <cmath>
#include <stdexcept>

#include "rays.hh"

namespace frobs
{
namespace
{
const double FASTEST = 1e6;  // [rad/s or m/s] beyond which a world has diverged
const int MOST_CONTACTS = 8;  // requested to check whether two shapes overlap
}

gazebo::physics::ModelPtr World::Model(const std::string &_name) const
{
  auto model = this->world->ModelByName(_name);
  if (!model)
    throw std::runtime_error("there is no model '" + _name + "'");
  return model;
}

gazebo::physics::ModelPtr World::Keep(const std::string &_name)
{
  auto model = this->Model(_name);
  this->models.insert(_name);
  return model;
}

void World::Setup(Reader &_message)
{
  auto physics = this->world->Physics();
  this->timestep = _message.Get<double>();
  physics->SetMaxStepSize(this->timestep);
  physics->SetRealTimeUpdateRate(0);
  physics->GetContactManager()->SetNeverDropContacts(true);
  this->Gravity(_message);
}

void World::Gravity(Reader &_message)
{
  const auto g = _message.Numbers(3);
  this->world->SetGravity(ignition::math::Vector3d(g[0], g[1], g[2]));
}

void World::Layout(Reader &_message)
{
  this->models.clear();
  this->joints.clear();
  this->links.clear();
  this->bodies.clear();
  this->pushes.clear();
  for (uint32_t i = _message.Count(); i > 0; --i)
  {
    const std::string model = _message.Text(), name = _message.Text(), child = _message.Text();
    Joint joint(this->Keep(model), name, child);
    joint.lower = _message.Get<double>();
    joint.upper = _message.Get<double>();
    joint.leader = _message.Get<int32_t>();
    joint.multiplier = _message.Get<double>();
    joint.offset = _message.Get<double>();
    this->joints.push_back(joint);
  }
  for (uint32_t i = _message.Count(); i > 0; --i)
  {
    const std::string model = _message.Text(), name = _message.Text();
    const bool stands = _message.Get<uint8_t>();
    auto link = boost::dynamic_pointer_cast<gazebo::physics::ODELink>(this->Keep(model)->GetLink(name));
    if (!link || !link->GetODEId())
      throw std::runtime_error("model '" + model + "' has no moving link '" + name + "'");
    if (stands)
    {
      // Contacts between two immovable bodies would be equations without unknowns.
      for (const auto &shape : link->GetCollisions())
      {
        shape->SetCategoryBits(GZ_FIXED_COLLIDE);
        shape->SetCollideBits(~GZ_FIXED_COLLIDE);
      }
    }
    this->links.push_back(link);
    this->bodies.push_back(link->GetODEId());
  }
  for (const std::string &model : this->contacts.Load(_message, this->world))
    this->models.insert(model);
}

std::string World::Part(Reader &_message)
{
  const auto model = this->Model(_message.Text());
  Writer pairs;
  for (uint32_t i = 0; i < this->bodies.size(); ++i)
  {
    for (uint32_t j = i + 1; j < this->bodies.size(); ++j)
    {
      const dBodyID one = this->bodies[i], other = this->bodies[j];
      if (this->links[i]->GetModel() != model || this->links[j]->GetModel() != model ||
          dAreConnectedExcluding(one, other, dJointTypeContact))
        continue;
      double deepest = 0;
      for (dGeomID a = dBodyGetFirstGeom(one); a; a = dBodyGetNextGeom(a))
      {
        for (dGeomID b = dBodyGetFirstGeom(other); b; b = dBodyGetNextGeom(b))
        {
          dContactGeom hits[MOST_CONTACTS];
          const int count = dCollide(a, b, MOST_CONTACTS, hits, sizeof(dContactGeom));
          for (int k = 0; k < count; ++k)
            deepest = std::max(deepest, static_cast<double>(hits[k].depth));
        }
      }
      if (deepest > 0)
      {
        // Gazebo disables collisions of bodies that a joint connects; this joint has no other effect.
        dJointAttach(dJointCreateNull(dBodyGetWorld(one), nullptr), one, other);
        pairs.Put(i);
        pairs.Put(j);
        pairs.Put(deepest);
      }
    }
  }
  return pairs.data;
}

void World::Gains(Reader &_message)
{
  for (auto &joint : this->joints)
  {
    joint.kp = _message.Get<double>();
    joint.kd = _message.Get<double>();
    joint.damping = _message.Get<double>();
    joint.friction = _message.Get<double>();
    joint.limit = _message.Get<double>();
  }
}

void World::Write(Reader &_message)
{
  for (uint32_t i = _message.Count(); i > 0; --i)
  {
    const dBodyID body = this->bodies.at(_message.Count());
    const auto s = _message.Numbers(13);
    const dQuaternion turn = {s[3], s[4], s[5], s[6]};
    dBodySetPosition(body, s[0], s[1], s[2]);
    dBodySetQuaternion(body, turn);
    dBodySetLinearVel(body, s[7], s[8], s[9]);
    dBodySetAngularVel(body, s[10], s[11], s[12]);
    dBodySetForce(body, 0, 0, 0);
    dBodySetTorque(body, 0, 0, 0);
    gazebo::physics::ODELink::MoveCallback(body);  // updates Gazebo itself, its sensors and windows
  }
  for (auto &joint : this->joints)
  {
    const double position = _message.Get<double>();
    if (std::isfinite(position))
      joint.PutAt(position);
  }
}

void World::Place(Reader &_message)
{
  const auto model = this->Model(_message.Text());
  const auto p = _message.Numbers(7);
  model->SetWorldPose(ignition::math::Pose3d(p[0], p[1], p[2], p[3], p[4], p[5], p[6]));
}

std::string World::Rays(Reader &_message)
{
  const uint32_t count = _message.Count();
  const double range = _message.Get<double>();
  const std::string blindTo = _message.Text();
  const auto origins = _message.Numbers(3 * count), directions = _message.Numbers(3 * count);
  const auto distances = Cast(this->world, origins, directions, range, blindTo);
  Writer answer;
  answer.Put(distances.data(), distances.size());
  return answer.data;
}

void World::Push(Reader &_message)
{
  Pushed push;
  push.body = this->bodies.at(_message.Count());
  for (double &number : push.numbers)
    number = _message.Get<double>();
  this->pushes.push_back(push);
}

void World::Mass(Reader &_message)
{
  const auto &link = this->links.at(_message.Count());
  const double mass = _message.Get<double>();
  const auto i = _message.Numbers(6);
  dMass whole;
  dMassSetParameters(&whole, mass, 0, 0, 0, i[0], i[3], i[5], i[1], i[2], i[4]);
  dBodySetMass(link->GetODEId(), &whole);
  link->GetInertial()->SetMass(mass);
}

void World::Friction(Reader &_message)
{
  const auto shapes = _message.Indices();
  const double coefficient = _message.Get<double>();
  for (const uint32_t shape : shapes)
  {
    auto pyramid = this->contacts.Shape(shape)->GetSurface()->FrictionPyramid();
    pyramid->SetMuPrimary(coefficient);
    pyramid->SetMuSecondary(coefficient);
  }
}

void World::Clear()
{
  this->contacts.Clear();
  this->pushes.clear();
  this->broken = false;
  for (auto &joint : this->joints)
    joint.effort = 0;
}

void World::Begin(uint32_t _steps, std::vector<double> _commands, uint32_t _rows)
{
  this->commands = std::move(_commands);
  this->rows = _rows;
  this->row = 0;
  this->left = _steps;
  this->contacts.Clear();
}

void World::BeforeStep()
{
  const double *given = this->commands.data() + this->joints.size() * std::min(this->row, this->rows - 1);
  for (size_t i = 0; i < this->joints.size(); ++i)
  {
    if (this->joints[i].leader < 0)
    {
      this->joints[i].command = given[i];
      this->joints[i].Drive();
    }
  }
  for (auto &joint : this->joints)
  {
    if (joint.leader >= 0)
    {
      const auto &leader = this->joints.at(joint.leader);
      joint.Follow(joint.multiplier * (leader.position + this->timestep * leader.velocity) + joint.offset);
    }
  }
  for (const auto &push : this->pushes)
  {
    const double *n = push.numbers;
    dBodyAddForceAtRelPos(push.body, n[3], n[4], n[5], n[0], n[1], n[2]);
    dBodyAddTorque(push.body, n[6], n[7], n[8]);
  }
  ++this->row;
}

bool World::AfterStep()
{
  this->contacts.Collect(this->world);
  this->broken = this->broken || !this->Sound();
  if (--this->left > 0 && !this->broken)
    return true;
  this->pushes.clear();
  return false;
}

bool World::Sound() const
{
  for (const dBodyID body : this->bodies)
  {
    const dReal *linear = dBodyGetLinearVel(body), *angular = dBodyGetAngularVel(body);
    for (int i = 0; i < 3; ++i)
    {
      if (!(std::abs(linear[i]) < FASTEST && std::abs(angular[i]) < FASTEST))  // also true for NaN
        return false;
    }
  }
  return true;
}

std::string World::State()
{
  Writer state;
  state.Put(this->broken ? 1.0 : 0.0);
  for (auto &joint : this->joints)
  {
    joint.Read();
    state.Put(joint.position);
    state.Put(joint.velocity);
    state.Put(joint.effort);
  }
  for (const dBodyID body : this->bodies)
  {
    const dReal *position = dBodyGetPosition(body), *turn = dBodyGetQuaternion(body);
    const dReal *linear = dBodyGetLinearVel(body), *angular = dBodyGetAngularVel(body);
    state.Put(position, 3);
    state.Put(turn, 4);
    state.Put(linear, 3);
    state.Put(angular, 3);
  }
  this->contacts.Write(state);
  return state.data;
}
}
