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
  auto *manager = _world->Physics()->GetContactManager();
  const auto &found = manager->GetContacts();
  for (unsigned int i = 0; i < manager->GetContactCount(); ++i)
  {
    const auto &contact = *found[i];
    auto one = this->indices.find(contact.collision1), other = this->indices.find(contact.collision2);
    if (one == this->indices.end() || other == this->indices.end())
      continue;
    double force = 0;
    for (int k = 0; k < contact.count; ++k)
      force = std::max(force, std::abs(contact.wrench[k].body1Force.Dot(contact.normals[k])));
    for (auto &asked : this->declared)
    {
      if (!asked.Means(one->second, other->second) && !asked.Means(other->second, one->second))
        continue;
      asked.seen = 1;
      asked.force = std::max(asked.force, force);
    }
  }
}

void Contacts::Clear()
{
  for (auto &contact : this->declared)
    contact.seen = contact.force = 0;
}

void Contacts::Write(Writer &_state) const
{
  for (const auto &contact : this->declared)
    _state.Put(contact.seen);
  for (const auto &contact : this->declared)
    _state.Put(contact.force);
}
}
