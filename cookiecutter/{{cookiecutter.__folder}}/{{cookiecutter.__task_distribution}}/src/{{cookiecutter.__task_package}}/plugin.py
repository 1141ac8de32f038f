{% if cookiecutter.what == "pair" %}
{{ partial("plugin.py", distribution=cookiecutter.__task_distribution, package=cookiecutter.__task_package, kinds="task") -}}
{% endif %}
