{% if cookiecutter.what != "pair" and "task" in cookiecutter.__kinds %}
{{ partial("test_task.py", distribution=cookiecutter.__folder, package=cookiecutter.__package, kinds=cookiecutter.__kinds) -}}
{% endif %}
