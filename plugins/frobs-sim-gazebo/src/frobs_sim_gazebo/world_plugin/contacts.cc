#include "contacts.hh"

#include <gazebo/physics/Contact.hh>
#include <gazebo/physics/ContactManager.hh>

#include <algorithm>
#include <cmath>

namespace frobs
{
std::set<std::string> Contacts::Load(Reader &_message, const gazebo::physics::WorldPtr &_world)
{
  std::set<std::string> models;
  this->shapes.clear();
  this->indices.clear();
  this->declared.clear();
  for (uint32_t i = _message.Count(); i > 0; --i)
  {
    const std::string model = _message.Text(), link = _message.Text(), name = _message.Text();
    auto found = _world->ModelByName(model);
    auto body = found ? found->GetLink(link) : nullptr;
    auto shape = body ? body->GetCollision(name) : nullptr;
    if (!shape)
      throw std::runtime_error("there is no shape '" + name + "' of link '" + link + "' of model '" + model + "'");
    this->indices[shape.get()] = this->shapes.size();
    this->shapes.push_back(shape);
    models.insert(model);
  }
  for (uint32_t i = _message.Count(); i > 0; --i)
  {
    Declared contact;
    contact.first = this->Mask(_message.Indices());
    contact.second = this->Mask(_message.Indices());
    if (_message.Get<uint8_t>())
      contact.second.assign(this->shapes.size(), 1);
    contact.ignored = this->Mask(_message.Indices());
    this->declared.push_back(contact);
  }
  return models;
}

std::vector<char> Contacts::Mask(const std::vector<uint32_t> &_indices) const
{
  std::vector<char> mask(this->shapes.size(), 0);
  for (const uint32_t index : _indices)
    mask.at(index) = 1;
  return mask;
}

void Contacts::Collect(const gazebo::physics::WorldPtr &_world)
{
  if (this->declared.empty())
    return;
  ++this->steps;
  auto *manager = _world->Physics()->GetContactManager();
  const auto &found = manager->GetContacts();
  for (unsigned int i = 0; i < manager->GetContactCount(); ++i)
  {
    const auto &contact = *found[i];
    auto one = this->indices.find(contact.collision1), other = this->indices.find(contact.collision2);
    if (one == this->indices.end() || other == this->indices.end())
      continue;
    double force = 0;
    ignition::math::Vector3d total;
    // Gazebo documents the world frame, but writes the forces in the frame of the link.
    const auto rotation = contact.collision1->GetLink()->WorldPose().Rot();
    for (int k = 0; k < contact.count; ++k)
    {
      const auto on_one = rotation.RotateVector(contact.wrench[k].body1Force);
      force = std::max(force, std::abs(on_one.Dot(contact.normals[k])));
      total += on_one;
    }
    for (auto &asked : this->declared)
    {
      const bool forward = asked.Means(one->second, other->second);
      const bool backward = asked.Means(other->second, one->second);
      if (!forward && !backward)
        continue;
      if (forward != backward)
        asked.total += forward ? total : -total;
      asked.seen = 1;
      asked.force = std::max(asked.force, force);
    }
  }
}

void Contacts::Clear()
{
  this->steps = 0;
  for (auto &contact : this->declared)
  {
    contact.seen = contact.force = 0;
    contact.total = ignition::math::Vector3d::Zero;
  }
}

void Contacts::Write(Writer &_state) const
{
  for (const auto &contact : this->declared)
  {
    _state.Put(contact.seen);
    _state.Put(contact.force);
    for (int axis = 0; axis < 3; ++axis)
      _state.Put(contact.total[axis] / std::max(this->steps, 1));
  }
}
}
