{% if cookiecutter.what == "pair" %}
{{ partial("test_task.py", distribution=cookiecutter.__task_distribution, package=cookiecutter.__task_package, kinds="task") -}}
{% endif %}
