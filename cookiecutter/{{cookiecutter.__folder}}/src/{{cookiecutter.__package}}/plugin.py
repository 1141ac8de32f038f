{% if cookiecutter.what != "pair" %}
{{ partial("plugin.py", distribution=cookiecutter.__folder, package=cookiecutter.__package, kinds=cookiecutter.__kinds) -}}
{% endif %}
