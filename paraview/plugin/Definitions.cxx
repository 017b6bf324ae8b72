// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Definitions.h"

#include "MapperXML.h"

#include "vtkIndent.h"
#include "vtkNew.h"
#include "vtkObject.h"
#include "vtkPVXMLElement.h"
#include "vtkPVXMLParser.h"

#include <sstream>

namespace
{

// A representation of volumes, and its classes with Halite.
struct Volume
{
  const char* Name;
  const char* Class;
  const char* SIClass;
};

const Volume Volumes[] = {
  { "UnstructuredGridVolumeRepresentation", "vtkHaliteVolumeRepresentation", "vtkSIHaliteVolumeRepresentationProxy" },
  { "StructuredGridVolumeRepresentation", "vtkHaliteVolumeRepresentation", "vtkSIHaliteVolumeRepresentationProxy" },
  { "UniformGridVolumeRepresentation", "vtkHaliteImageVolumeRepresentation",
    "vtkSIHaliteImageVolumeRepresentationProxy" },
};

// A representation whose displays show the properties of those, and that whose properties from representations.xml it shows.
struct Display
{
  const char* Name;
  const char* Volume;
};

const Display Displays[] = {
  { "UnstructuredGridRepresentation", "UnstructuredGridVolumeRepresentation" },
  { "StructuredGridRepresentation", "UnstructuredGridVolumeRepresentation" },
  { "UniformGridRepresentation", "UniformGridVolumeRepresentation" },
};

const char* const Group = "representations";
const char* const SubProxy = "VolumeHaliteMapper";

bool Is(vtkPVXMLElement* element, const char* name)
{
  return element && element->GetName() && std::string(element->GetName()) == name;
}

std::string Attribute(vtkPVXMLElement* element, const char* name)
{
  return element->GetAttributeOrEmpty(name);
}

vtkSmartPointer<vtkPVXMLElement> Parse(const std::string& xml)
{
  vtkNew<vtkPVXMLParser> parser;
  return parser->Parse(xml.c_str()) ? parser->GetRootElement() : nullptr;
}

void Add(vtkPVXMLElement* element, const std::string& xml)
{
  element->AddNestedElement(Parse(xml));
}

std::string Text(vtkPVXMLElement* element)
{
  std::ostringstream text;
  element->PrintXML(text, vtkIndent());
  return text.str();
}

// The child of this name and, if asked for, with this value of the attribute "name"; null if there is none.
vtkPVXMLElement* Child(vtkPVXMLElement* parent, const char* name, const char* called = nullptr)
{
  for (unsigned int i = 0; parent && i < parent->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* child = parent->GetNestedElement(i);
    if (Is(child, name) && (!called || Attribute(child, "name") == called))
    {
      return child;
    }
  }
  return nullptr;
}

// The names of the mapper's properties, as it has them.
std::vector<std::string> MapperProperties()
{
  std::vector<std::string> names;
  const vtkSmartPointer<vtkPVXMLElement> mapper = Parse(MapperXML);
  for (unsigned int i = 0; i < mapper->GetNumberOfNestedElements(); ++i)
  {
    names.push_back(Attribute(mapper->GetNestedElement(i), "name"));
  }
  return names;
}

// What a property is shown by: the display's mapper is Halite.
const char* const Shown =
  R"(<Hints><PropertyWidgetDecorator type="GenericDecorator" mode="visibility" property="SelectMapper"
  value="Halite"/></Hints>)";

// What representations.xml has for a representation of volumes.
vtkSmartPointer<vtkPVXMLElement> Additions(const char* volume)
{
  const vtkSmartPointer<vtkPVXMLElement> all = Parse(RepresentationsXML);
  for (unsigned int i = 0; all && i < all->GetNumberOfNestedElements(); ++i)
  {
    if (Attribute(all->GetNestedElement(i), "of") == volume)
    {
      return all->GetNestedElement(i);
    }
  }
  return vtkSmartPointer<vtkPVXMLElement>::New();
}

std::string Mapper()
{
  const vtkSmartPointer<vtkPVXMLElement> mapper = Parse(MapperXML);
  for (unsigned int i = 0; i < mapper->GetNumberOfNestedElements(); ++i)
  {
    Add(mapper->GetNestedElement(i), Shown);
  }
  return Text(mapper);
}

// Whether the representation has a list of mappers; Halite is in it now.
bool AddMapper(vtkPVXMLElement* representation)
{
  const vtkSmartPointer<vtkPVXMLElement> additions = Additions(representation->GetAttributeOrEmpty("name"));
  for (unsigned int i = 0; i < additions->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* property = additions->GetNestedElement(i);
    // A later ParaView may have what this one lacks.
    if (!Child(representation, property->GetName(), property->GetAttributeOrEmpty("name")))
    {
      const bool isList = Attribute(property, "name") == "SelectMapper";
      if (!isList)
      {
        Add(property, Shown);
      }
      representation->AddNestedElement(property);
    }
  }
  vtkPVXMLElement* list = Child(Child(representation, "StringVectorProperty", "SelectMapper"), "StringListDomain");
  if (!list)
  {
    return false;
  }
  Add(list, R"(<String value="Halite"/>)");
  std::string exposed;
  for (const std::string& name : MapperProperties())
  {
    exposed += "<Property name=\"" + name + "\" exposed_name=\"Halite" + name + "\"/>";
  }
  Add(representation,
    std::string("<SubProxy><Proxy name=\"") + SubProxy + "\" proxygroup=\"mappers\" proxyname=\"HaliteMapper\"/>" +
      "<ExposedProperties>" + exposed + "</ExposedProperties></SubProxy>");
  return true;
}

// Whether the display has the properties of a volume; those of the volume's additions and the mapper's are among them now.
bool AddProperties(vtkPVXMLElement* display, const char* volume)
{
  for (unsigned int i = 0; i < display->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* part = display->GetNestedElement(i);
    if (!Is(part, "SubProxy") || !Child(part, "Proxy", "VolumeRepresentation"))
    {
      continue;
    }
    vtkPVXMLElement* group = Child(Child(part, "ExposedProperties"), "PropertyGroup");
    if (!group)
    {
      return false;
    }
    const auto expose = [group](const std::string& name) {
      if (!Child(group, "Property", name.c_str()))
      {
        Add(group,
          "<Property name=\"" + name +
            "\" panel_visibility=\"advanced\" panel_visibility_default_for_representation=\"volume\"/>");
      }
    };
    const vtkSmartPointer<vtkPVXMLElement> additions = Additions(volume);
    for (unsigned int j = 0; j < additions->GetNumberOfNestedElements(); ++j)
    {
      vtkPVXMLElement* property = additions->GetNestedElement(j);
      // The display's surfaces have what is shared, under the same name.
      if (!property->GetAttribute("shared"))
      {
        expose(property->GetAttributeOrEmpty("name"));
      }
    }
    for (const std::string& name : MapperProperties())
    {
      expose("Halite" + name);
    }
    return true;
  }
  return false;
}

}

Definitions::Definitions() = default;
Definitions::~Definitions() = default;

void Definitions::Read(const std::string& xml)
{
  // Most of ParaView's configurations are large, and have none of these.
  if (xml.find(Group) == std::string::npos)
  {
    return;
  }
  const vtkSmartPointer<vtkPVXMLElement> root = Parse(xml);
  for (unsigned int i = 0; root && i < root->GetNumberOfNestedElements(); ++i)
  {
    vtkPVXMLElement* group = root->GetNestedElement(i);
    if (!Is(group, "ProxyGroup") || Attribute(group, "name") != Group)
    {
      continue;
    }
    for (unsigned int j = 0; j < group->GetNumberOfNestedElements(); ++j)
    {
      vtkPVXMLElement* proxy = group->GetNestedElement(j);
      const std::string name = Attribute(proxy, "name");
      const auto known = this->Representations.find(name);
      if (!Is(proxy, "Extension"))
      {
        this->Representations[name] = proxy;
      }
      else if (known != this->Representations.end())
      {
        for (unsigned int k = 0; k < proxy->GetNumberOfNestedElements(); ++k)
        {
          known->second->AddNestedElement(proxy->GetNestedElement(k));
        }
      }
    }
  }
}

std::string Definitions::WithHalite() const
{
  std::string changed;
  const auto change = [&](const std::string& name, auto how) {
    const auto known = this->Representations.find(name);
    // The definitions of this process are read again for each session, and stay as they are.
    const vtkSmartPointer<vtkPVXMLElement> proxy =
      known == this->Representations.end() ? nullptr : Parse(Text(known->second));
    if (proxy && how(proxy.Get()))
    {
      changed += Text(proxy);
    }
    else
    {
      vtkGenericWarningMacro("Halite knows no way into this ParaView's " << name << ", and is not in it");
    }
  };
  for (const Volume& volume : Volumes)
  {
    change(volume.Name, [&volume](vtkPVXMLElement* proxy) {
      proxy->SetAttribute("class", volume.Class);
      proxy->SetAttribute("si_class", volume.SIClass);
      // What has a base has the base's list.
      return proxy->GetAttribute("base_proxyname") ? true : AddMapper(proxy);
    });
  }
  for (const Display& display : Displays)
  {
    change(display.Name, [&display](vtkPVXMLElement* proxy) { return AddProperties(proxy, display.Volume); });
  }
  return std::string("<ServerManagerConfiguration><ProxyGroup name=\"mappers\">") + Mapper() +
    "</ProxyGroup><ProxyGroup name=\"" + Group + "\">" + changed + "</ProxyGroup></ServerManagerConfiguration>";
}
