{% if cookiecutter.what == "pair" %}
{{ partial("plugin.py", distribution=cookiecutter.__robot_distribution, package=cookiecutter.__robot_package, kinds="robot") -}}
{% endif %}
